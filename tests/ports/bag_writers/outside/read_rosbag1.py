#!/usr/bin/env python3
"""Reading of a simulated ROS 1 bag by ROS' own library: read_rosbag1.py RECORDING

RECORDING is a folder that `unimapper simulate --distortion --bag rosbag1` wrote. Ends with 77
where Debian's python3-rosbag is missing.
"""
import hashlib
import pathlib
import struct
import sys

try:
    import genpy.dynamic
    import rosbag
except ImportError as error:
    print(f"skipped: {error}; Debian's python3-rosbag and python3-sensor-msgs have it")
    sys.exit(77)


def md5_of(name, definitions):
    """The MD5 by which ROS 1 recognises a type, of definitions without comments."""
    package = name.split("/")[0]
    constants, fields = [], []
    for line in definitions[name].splitlines():
        kind, _, field = line.partition(" ")
        base = kind.split("[")[0]
        if "=" in field:
            constants.append(line)
            continue
        for known in (base, f"{package}/{base}"):
            if known in definitions:
                line = f"{md5_of(known, definitions)} {field}"
        fields.append(line)
    return hashlib.md5("\n".join(constants + fields).encode()).hexdigest()


def check_definitions(bag):
    for connection in bag._get_connections():
        parts = connection.msg_def.split("=" * 80 + "\nMSG: ")
        definitions = {connection.datatype: parts[0].strip()}
        for part in parts[1:]:
            name, _, text = part.partition("\n")
            definitions[name] = text.strip()
        found = md5_of(connection.datatype, definitions)
        assert found == connection.md5sum, f"{connection.datatype}: MD5 {found}"


def main(recording):
    scans = sorted((recording / "scans").glob("*.bin"))
    with rosbag.Bag(recording / "drive.bag") as bag:
        check_definitions(bag)
        topics = bag.get_type_and_topic_info().topics
        counts = {name: (info.msg_type, info.message_count) for name, info in topics.items()}
        assert counts == {
            "/points": ("sensor_msgs/PointCloud2", len(scans)),
            "/odom": ("nav_msgs/Odometry", 10 * len(scans) + 1),
            "/tf": ("tf2_msgs/TFMessage", 10 * len(scans) + 1),
            "/tf_static": ("tf2_msgs/TFMessage", 1),
        }, counts
        clouds = 0
        for _, cloud, stamp in bag.read_messages("/points"):
            assert cloud.header.stamp == stamp
            points = scans[clouds].read_bytes()
            assert cloud.width * 16 == len(points), "number of points"
            assert [f.name for f in cloud.fields] == ["x", "y", "z", "intensity", "ring", "time"]
            for i in range(cloud.width):
                at = i * cloud.point_step
                assert cloud.data[at:at + 16] == points[16 * i:16 * i + 16], f"point {i}"
                (time,) = struct.unpack_from("<f", cloud.data, at + cloud.fields[5].offset)
                assert -0.1001 <= time <= 0.0, f"time of point {i}"
            clouds += 1
        for _, message, _ in bag.read_messages("/tf_static"):
            assert message.transforms[0].child_frame_id == "lidar"
        print(f"{clouds} clouds equal to the scans")


main(pathlib.Path(sys.argv[1]))
