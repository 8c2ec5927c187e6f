#!/usr/bin/env python3
"""The recording of make_ros2.mjs as a bag of ROS 1, written by Debian's python3-rosbag.

Its chunks are compressed by bzip2 and LZ4 in turn. The tests read the committed file, not this
script.
  apt-get install python3-rosbag python3-sensor-msgs python3-nav-msgs python3-tf2-msgs
  python3 make_bag.py drive.bag
"""
import math
import struct
import sys

import genpy
import rosbag
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage


def time(ms):
    return genpy.Time(100 + ms // 1000, ms % 1000 * 1000000)


def cloud(ms):
    message = PointCloud2()
    message.header.stamp = time(ms)
    message.header.frame_id = "lidar"
    message.height, message.width = 1, 3
    message.fields = [PointField(name, offset, datatype, 1) for name, offset, datatype in (
        ("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("t", 16, 6), ("ring", 20, 4))]
    message.point_step, message.row_step = 22, 66
    nan = math.nan
    message.data = b"".join(struct.pack("<ffffIH", *point) for point in (
        (1, 2, 3, 10, 0, 0), (nan, nan, nan, 0, 50000000, 1), (4, 5, 6, 20, 99000000, 2)))
    return message


def odometry(ms):
    message = Odometry()
    message.header.stamp = time(ms)
    message.header.frame_id = "odom"
    message.child_frame_id = "base_link"
    message.pose.pose.position.x = ms * 0.01
    message.pose.pose.orientation.w = 1
    return message


def transforms():
    message = TransformStamped()
    message.header.stamp = time(-1000)
    message.header.frame_id = "base_link"
    message.child_frame_id = "lidar"
    message.transform.translation.x, message.transform.translation.z = 0.5, 1.2
    message.transform.rotation.z = message.transform.rotation.w = math.sqrt(0.5)
    return TFMessage([message])


def write(bag, topic, ms, message):
    # The text of the definition is left out to keep the file small: readers go by the name.
    bag.write(topic, message, time(ms), connection_header={
        "topic": topic, "type": message._type, "md5sum": message._md5sum, "message_definition": ""})


with rosbag.Bag(sys.argv[1], "w", compression="bz2") as bag:
    write(bag, "/tf_static", -1000, transforms())
    write(bag, "/rosout", -1000, String("not read"))
    for ms in range(-60, 301, 20):
        if ms <= 240:
            write(bag, "/odom", ms, odometry(ms))
        if ms % 100 == 0 and ms >= 0:
            write(bag, "/points", ms + 100, cloud(ms))
            bag.compression = "lz4" if bag.compression == "bz2" else "bz2"
