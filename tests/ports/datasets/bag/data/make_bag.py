#!/usr/bin/env python3
"""The recording of make_mcap.mjs as a bag of ROS 1, written by Debian's python3-rosbag.

The tests read the committed files, not this script.
  apt-get install python3-rosbag python3-sensor-msgs python3-nav-msgs python3-tf2-msgs
  python3 make_bag.py bz2|lz4 FILE
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


compression, path = sys.argv[1:]
with rosbag.Bag(path, "w", compression=compression, chunk_threshold=3000) as bag:
    bag.write("/tf_static", transforms(), time(-1000))
    bag.write("/rosout", String("not read"), time(-1000))
    for ms in range(-60, 301, 20):
        if ms <= 240:
            bag.write("/odom", odometry(ms), time(ms))
        if ms % 100 == 0 and ms >= 0:
            bag.write("/points", cloud(ms), time(ms + 100))
