#!/usr/bin/env python3
"""Reading of a simulated ROS 2 bag by Python's own SQLite: read_rosbag2.py RECORDING

RECORDING is a folder that `unimapper simulate --distortion --bag rosbag2` wrote. What is needed
of metadata.yaml is looked for as text: Python has no parser of YAML.
"""
import pathlib
import sqlite3
import struct
import sys


POINT_BYTES = 22


def points_of(message, count):
    """Points of a PointCloud2 in CDR: its last bytes but the flag that ends it."""
    assert message[:4] == b"\0\1\0\0", "little-endian CDR"
    begin = len(message) - 1 - count * POINT_BYTES
    assert struct.unpack_from("<I", message, begin - 4) == (count * POINT_BYTES,), "bytes of points"
    return [message[at:at + 16] for at in range(begin, len(message) - 1, POINT_BYTES)]


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
        expected = scan.read_bytes()
        assert b"".join(points_of(message, len(expected) // 16)) == expected, scan.name
        clouds += 1
    assert clouds == len(scans)
    metadata = (recording / "drive" / "metadata.yaml").read_text()
    assert f"  message_count: {sum(count for _, _, count in counts.values())}\n" in metadata
    assert "    - drive_0.db3\n" in metadata
    print(f"{clouds} clouds equal to the scans")


main(pathlib.Path(sys.argv[1]))
