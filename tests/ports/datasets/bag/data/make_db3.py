#!/usr/bin/env python3
"""The recording of make_mcap.mjs as a bag of ROS 2 in SQLite, with Python's sqlite3.

Tables and columns are rosbag2's; messages are CDR made by hand from its definition. The tests read
the committed files, not this script.
  python3 make_db3.py FILE [zstd]     zstd: every message compressed, by the program zstd
"""
import math
import sqlite3
import struct
import subprocess
import sys


class Cdr:
    """Little-endian CDR: numbers are aligned to their size, strings end in a zero."""

    def __init__(self):
        self.data = b""

    def put(self, form, *values):
        for value in values:
            size = struct.calcsize(form)
            self.data += b"\0" * (-len(self.data) % size) + struct.pack("<" + form, value)
        return self

    def text(self, value):
        self.put("I", len(value) + 1)
        self.data += value.encode() + b"\0"
        return self

    def header(self, ms, frame):
        ns = 100 * 10**9 + ms * 10**6
        return self.put("i", ns // 10**9).put("I", ns % 10**9).text(frame)

    def bytes(self):
        return b"\0\1\0\0" + self.data


def cloud(ms):
    cdr = Cdr().header(ms, "lidar").put("I", 1, 3)
    fields = (("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("t", 16, 6),
              ("ring", 20, 4))
    cdr.put("I", len(fields))
    for name, offset, datatype in fields:
        cdr.text(name).put("I", offset).put("B", datatype).put("I", 1)
    nan = math.nan
    points = b"".join(struct.pack("<ffffIH", *point) for point in (
        (1, 2, 3, 10, 0, 0), (nan, nan, nan, 0, 50000000, 1), (4, 5, 6, 20, 99000000, 2)))
    cdr.put("?", False).put("I", 22, 66, len(points))
    cdr.data += points
    return cdr.put("?", False).bytes()


def odometry(ms):
    cdr = Cdr().header(ms, "odom").text("base_link")
    cdr.put("d", ms * 0.01, 0, 0, 0, 0, 0, 1)
    return cdr.put("d", *[0] * (36 + 6 + 36)).bytes()


def transforms():
    cdr = Cdr().put("I", 1).header(-1000, "base_link").text("lidar")
    return cdr.put("d", 0.5, 0, 1.2, 0, 0, math.sqrt(0.5), math.sqrt(0.5)).bytes()


def packed(message):
    if "zstd" not in sys.argv[2:]:
        return message
    return subprocess.run(["zstd", "-c"], input=message, stdout=subprocess.PIPE, check=True).stdout


database = sqlite3.connect(sys.argv[1])
database.executescript("""
PRAGMA page_size = 512;
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
INSERT INTO schema VALUES(3, 'humble');
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,
  metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
  timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO topics VALUES(1, '/points', 'sensor_msgs/msg/PointCloud2', 'cdr', '');
INSERT INTO topics VALUES(2, '/odom', 'nav_msgs/msg/Odometry', 'cdr', '');
INSERT INTO topics VALUES(3, '/tf_static', 'tf2_msgs/msg/TFMessage', 'cdr', '');
INSERT INTO topics VALUES(4, '/rosout', 'std_msgs/msg/String', 'cdr', '');
""")


def write(topic, ms, message):
    database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                     (topic, 100 * 10**9 + ms * 10**6, packed(message)))


write(3, -1000, transforms())
write(4, -1000, Cdr().text("not read").bytes())
for ms in range(-60, 301, 20):
    if ms <= 240:
        write(2, ms, odometry(ms))
    if ms % 100 == 0 and ms >= 0:
        write(1, ms + 100, cloud(ms))
database.commit()
