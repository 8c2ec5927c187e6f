#!/usr/bin/env python3
"""Reading of a simulated ROS 2 bag by Python's own SQLite: read_rosbag2.py RECORDING

RECORDING is a folder that `unimapper simulate --distortion --bag rosbag2` wrote. What is needed
of metadata.yaml is looked for as text: Python has no parser of YAML.
"""
import pathlib
import sqlite3
import struct
import sys


def points_of(message):
    """Bytes of the points of a PointCloud2 in CDR, and the length of one."""
    assert message[:4] == b"\0\1\0\0", "little-endian CDR"
    data = message[4:]
    at = 8

    def uint32():
        nonlocal at
        at = (at + 3) // 4 * 4 + 4
        return struct.unpack_from("<I", data, at - 4)[0]

    def skip_text():
        nonlocal at
        length = uint32()
        at += length

    skip_text()  # frame
    uint32(), uint32()
    for _ in range(uint32()):
        skip_text()
        uint32()
        at += 1
        uint32()
    at += 1
    step, _, count = uint32(), uint32(), uint32()
    return data[at:at + count], step


def main(recording):
    scans = sorted((recording / "scans").glob("*.bin"))
    bag = sqlite3.connect(recording / "drive" / "drive_0.db3")
    assert bag.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    counts = {
        name: (kind, encoding, count) for name, kind, encoding, count in bag.execute(
            "SELECT name, type, serialization_format, COUNT(*) FROM topics"
            " JOIN messages ON topic_id = topics.id GROUP BY name")
    }
    assert counts == {
        "/points": ("sensor_msgs/msg/PointCloud2", "cdr", len(scans)),
        "/odom": ("nav_msgs/msg/Odometry", "cdr", 10 * len(scans) + 1),
        "/tf": ("tf2_msgs/msg/TFMessage", "cdr", 10 * len(scans) + 1),
        "/tf_static": ("tf2_msgs/msg/TFMessage", "cdr", 1),
    }, counts
    rows = bag.execute("SELECT timestamp, data FROM messages JOIN topics ON topic_id = topics.id"
                       " WHERE name = '/points' ORDER BY timestamp")
    clouds = 0
    for (stamp, message), scan in zip(rows, scans):
        assert stamp == 100_000_000 * (clouds + 1)
        points, step = points_of(message)
        expected = scan.read_bytes()
        assert len(points) // step * 16 == len(expected), "number of points"
        for i in range(len(points) // step):
            found = points[i * step:i * step + 16]
            assert found == expected[16 * i:16 * i + 16], f"point {i} of {scan.name}"
        clouds += 1
    assert clouds == len(scans)
    metadata = (recording / "drive" / "metadata.yaml").read_text()
    assert f"  message_count: {sum(count for _, _, count in counts.values())}\n" in metadata
    assert "    - drive_0.db3\n" in metadata
    print(f"{clouds} clouds equal to the scans")


main(pathlib.Path(sys.argv[1]))
