#!/usr/bin/env python3
"""Loop verification and changes of a merged demo against the simulator's truth.

usage: score.py MAP DATA

MAP is the output of `unimapper merge` of simulated sessions, DATA the folder with one recording
per session, named like the sessions. Prints one row of a Markdown table: loops accepted (true /
false), loops refused for structure in free space (true / false), changed points, and the share of
them that the truth labels as something movable. A loop is true within a metre.
"""

import array
import collections
import csv
import json
import math
import pathlib
import struct
import sys

MOVABLE = {10, 11, 13, 15, 18, 20, 30, 31, 252, 253, 254, 255, 257, 258, 259}
VOXELS_PER_METRE = 2.5
SCANS_APART = 8
REACH_M = 40.0


def count_loops(map_folder, data):
    poses = {
        session.name: [[float(v) for v in line.split()] for line in (session / "gt_poses.txt").open()]
        for session in data.iterdir()
    }

    def error_m(row):
        match = poses[row["match_session"]][int(row["match_scan"])]
        query = poses[row["query_session"]][int(row["query_scan"])]
        dx, dy = query[3] - match[3], query[7] - match[7]
        yaw = math.atan2(match[4], match[0])
        x = math.cos(yaw) * dx + math.sin(yaw) * dy
        y = math.cos(yaw) * dy - math.sin(yaw) * dx
        return math.hypot(x - float(row["x"]), y - float(row["y"]))

    count = collections.Counter()
    for row in csv.DictReader((map_folder / "loops.csv").open()):
        outcome = "accepted" if row["accepted"] == "1" else "other"
        if "free space" in row["reason"]:
            outcome = "free space"
        count[outcome, error_m(row) < 1.0] += 1
    return count


def rotation(x, y, z, w):
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def voxel(x, y, z):
    return tuple(math.floor(v * VOXELS_PER_METRE) for v in (x, y, z))


def read_changes(path):
    content = path.read_bytes()
    start = content.index(b"end_header\n") + len(b"end_header\n")
    record = struct.Struct("<fffBBBHB")
    return [point for point in record.iter_unpack(content[start:])]


def labels_of(wanted, map_folder, recording):
    """Truth labels in the voxels `wanted`, map frame."""
    poses = {}
    for line in (map_folder / "trajectories" / f"{recording.name}.tum").open():
        values = [float(v) for v in line.split()]
        poses[round(values[0] * 1000)] = values[1:]
    found = collections.defaultdict(collections.Counter)
    times = [float(line) for line in (recording / "times.txt").open()]
    for scan in range(0, len(times), SCANS_APART):
        pose = poses.get(round(times[scan] * 1000))
        if pose is None:
            continue
        r, t = rotation(*pose[3:]), pose[:3]
        points = array.array("f", (recording / "scans" / f"{scan:06d}.bin").read_bytes())
        labels = array.array("I", (recording / "labels" / f"{scan:06d}.label").read_bytes())
        for i, label in enumerate(labels):
            p = points[4 * i : 4 * i + 3]
            if p[0] * p[0] + p[1] * p[1] > REACH_M * REACH_M:
                continue
            at = voxel(*(sum(r[a][b] * p[b] for b in range(3)) + t[a] for a in range(3)))
            if at in wanted:
                found[at][label & 0xFFFF] += 1
    return found


def count_changes(map_folder, data):
    points = read_changes(map_folder / "changes.ply")
    sessions = json.loads((map_folder / "summary.json").read_text())["sessions"]
    movable = known = 0
    for number, session in enumerate(sessions):
        own = [voxel(*point[:3]) for point in points if point[6] == number]
        found = labels_of(set(own), map_folder, data / session["name"]) if own else {}
        for at in own:
            if at not in found:
                continue
            known += 1
            movable += found[at].most_common(1)[0][0] in MOVABLE
    return len(points), movable / max(known, 1)


def main():
    map_folder, data = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    loops = count_loops(map_folder, data)
    points, share = count_changes(map_folder, data)
    print(
        f"| {loops['accepted', True]} / {loops['accepted', False]} "
        f"| {loops['free space', True]} / {loops['free space', False]} "
        f"| {points} | {100 * share:.1f} % |"
    )


if __name__ == "__main__":
    main()
