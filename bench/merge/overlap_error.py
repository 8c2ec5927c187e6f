#!/usr/bin/env python3
"""Error of two merged sessions relative to each other: overlap_error.py MAP SESSION=DATASET TWICE

Prints what became of the pair: the status of the session that is not central, as summary.json has
it, and if it shares the map with the other, the root mean square (metres) over its keyframes that
lie within 15 m of one of the other's: how far each is from where it belongs, seen from the nearest.
"none" instead of metres: there are no such keyframes, the sessions do not overlap.
"""
import json
import math
import sys

NEAR_M = 15.0


def rotation(x, y, z, w):
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def estimated(path):
    """Poses as (rotation, translation) by stamp, of a TUM file."""
    poses = {}
    for line in open(path):
        if line.startswith("#") or not line.strip():
            continue
        stamp, tx, ty, tz, qx, qy, qz, qw = map(float, line.split())
        poses[stamp] = (rotation(qx, qy, qz, qw), [tx, ty, tz])
    return poses


def true(dataset, stamps):
    """True poses at the recording's scans that are nearest to the stamps."""
    times = [float(line) for line in open(dataset + "/times.txt")]
    rows = [list(map(float, line.split())) for line in open(dataset + "/gt_poses.txt")]
    poses = []
    for stamp in stamps:
        i = min(range(len(times)), key=lambda k: abs(times[k] - stamp))
        if abs(times[i] - stamp) > 0.01:
            sys.exit(f"error: {dataset} has no scan at {stamp}")
        v = rows[i]
        poses.append(([v[0:3], v[4:7], v[8:11]], [v[3], v[7], v[11]]))
    return poses


def seen_from(pose, point):
    d = [point[i] - pose[1][i] for i in range(3)]
    return [sum(pose[0][k][i] * d[k] for k in range(3)) for i in range(3)]


def overlap_error(folder, sessions):
    estimate, truth = [], []
    for name, dataset in sessions:
        poses = estimated(f"{folder}/trajectories/{name}.tum")
        estimate.append(list(poses.values()))
        truth.append(true(dataset, list(poses)))
    squares = []
    for j, pose in enumerate(truth[1]):
        i = min(range(len(truth[0])), key=lambda k: math.dist(truth[0][k][1], pose[1]))
        if math.dist(truth[0][i][1], pose[1]) > NEAR_M:
            continue
        right = seen_from(truth[0][i], pose[1])
        found = seen_from(estimate[0][i], estimate[1][j][1])
        squares.append(math.dist(right, found) ** 2)
    return math.sqrt(sum(squares) / len(squares)) if squares else None


def main():
    folder = sys.argv[1]
    sessions = [argument.split("=", 1) for argument in sys.argv[2:4]]
    summary = json.load(open(folder + "/summary.json"))
    status = [s["status"] for s in summary["sessions"] if s["status"] != "central"][0]
    if status != "merged":
        print(status)
        return
    error = overlap_error(folder, sessions)
    print(status, "none" if error is None else f"{error:.3f}")


if __name__ == "__main__":
    main()
