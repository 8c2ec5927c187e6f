#!/usr/bin/env python3
"""Cells of bench/input/checks.sh: drives whose poses are wrong, as `unimapper inspect` sees them

usage: checks.py UNIMAPPER FOLDER KIND VALUE SEED...

KIND is none, roll, pitch, yaw (degrees), x, y (m), late (s), scale (of the positions), inverted, camera (its
axes), mirror (the y axis), over (the LiDAR
upside down, its own odometry), or what happens half way: jump (m to the side), restart (at the origin) or carried (s
without motion); names (scans in the order of their numbers as text). KIND limits: of the check VALUE
unit, limits and the largest figure where nothing is wrong.
 LIVE=PROGRAM: what PROGRAM (live_checks) says while the robot drives: drives, said, said as that, and of these the
median of the seconds until then and the longest.
 NOISE=DEGREES: of roll and pitch, on top of that. DRIVES=PATTERN: only these; VERBOSE=1: a line for each on stderr.
"""
import fnmatch
import json
import math
import os
import random
import struct
import subprocess
import sys
import tempfile


def product(a, b):
    rotation = [[sum(a[r][k] * b[k][c] for k in range(3)) for c in range(3)] for r in range(3)]
    return [rotation[r] + [sum(a[r][k] * b[k][3] for k in range(3)) + a[r][3]] for r in range(3)]


def inverse(a):
    return [[a[c][r] for c in range(3)] + [-sum(a[c][r] * a[c][3] for c in range(3))]
            for r in range(3)]


def mount(kind, value):
    """T_base_lidar with one value."""
    pose = [[float(r == c) for c in range(4)] for r in range(3)]
    if kind in ("x", "y"):
        pose["xy".index(kind)][3] = value
    if kind in ("roll", "pitch", "yaw"):
        axis = ("roll", "pitch", "yaw").index(kind)
        j, k = (axis + 1) % 3, (axis + 2) % 3
        pose[j][j] = pose[k][k] = math.cos(math.radians(value))
        pose[k][j] = math.sin(math.radians(value))
        pose[j][k] = -pose[k][j]
    return pose


def between(a, b, share):
    """Pose at a share of the way; rotations are near to each other."""
    mixed = [[(1 - share) * p + share * q for p, q in zip(x, y)] for x, y in zip(a, b)]
    columns = []
    for c in range(3):
        v = [mixed[r][c] for r in range(3)]
        for u in columns:
            along = sum(p * q for p, q in zip(u, v))
            v = [p - along * q for p, q in zip(v, u)]
        length = math.sqrt(sum(p * p for p in v))
        columns.append([p / length for p in v])
    return [[columns[c][r] for c in range(3)] + [mixed[r][3]] for r in range(3)]


def late(poses, times, by):
    result = []
    for t in times:
        at = 0
        while at + 2 < len(times) and times[at + 1] <= t - by:
            at += 1
        share = (t - by - times[at]) / (times[at + 1] - times[at])
        result.append(between(poses[at], poses[at + 1], share))
    return result


def turn_over(source, target):
    for name in os.listdir(source):
        with open(os.path.join(source, name), "rb") as scan:
            values = list(struct.iter_unpack("<4f", scan.read()))
        with open(os.path.join(target, name), "wb") as scan:
            scan.write(b"".join(struct.pack("<4f", x, -y, -z, i) for x, y, z, i in values))


def broken(poses, times, kind, value):
    middle = len(poses) // 2
    again = middle
    if kind == "carried":
        while again + 1 < len(poses) and times[again] < times[middle] + value:
            again += 1
    start = poses[middle]
    if kind == "jump":
        start = product(start, mount("y", value))
    elif kind == "restart":
        start = mount("none", 0.0)
    onward = product(start, inverse(poses[again]))
    return poses[:middle] + [start] * (again - middle) + [product(onward, p) for p in poses[again:]]


def noisy(poses, degrees):
    dice = random.Random(4)
    scattered = poses[:1]
    for pose in poses[1:]:
        for axis in ("roll", "pitch"):
            pose = product(pose, mount(axis, dice.gauss(0.0, degrees)))
        scattered.append(pose)
    return scattered


def make(source, target, kind, value):
    with open(os.path.join(source, "poses.txt")) as lines:
        numbers = [[float(v) for v in line.split()] for line in lines]
    poses = [[row[4 * r:4 * r + 4] for r in range(3)] for row in numbers]
    with open(os.path.join(source, "times.txt")) as lines:
        times = [float(line) for line in lines]
    if kind == "late":
        poses = late(poses, times, value)
    elif kind in ("jump", "restart", "carried"):
        poses = broken(poses, times, kind, value)
    elif kind == "names":
        poses = [poses[k] for k in sorted(range(len(poses)), key=str)]
    elif kind == "mirror":
        poses = [[[-v if (r == 1) != (c == 1) else v for c, v in enumerate(row)]
                  for r, row in enumerate(pose)] for pose in poses]
    elif kind == "scale":
        poses = [[row[:3] + [value * row[3]] for row in pose] for pose in poses]
    elif kind == "inverted":
        poses = [inverse(pose) for pose in poses]
    elif kind == "camera":
        axes = [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0]]
        poses = [product(product(axes, pose), inverse(axes)) for pose in poses]
    elif kind == "over":
        over = mount("roll", 180.0)
        poses = [product(product(over, pose), over) for pose in poses]
    else:
        poses = [product(pose, inverse(mount(kind, value))) for pose in poses]
    if os.environ.get("NOISE"):
        poses = noisy(poses, float(os.environ["NOISE"]))
    for name in os.listdir(source):
        if name == "poses.txt":
            continue
        if name == "scans" and kind == "over":
            os.mkdir(os.path.join(target, name))
            turn_over(os.path.join(source, name), os.path.join(target, name))
        else:
            os.symlink(os.path.abspath(os.path.join(source, name)), os.path.join(target, name))
    with open(os.path.join(target, "poses.txt"), "w") as lines:
        for pose in poses:
            lines.write(" ".join("%.9g" % v for row in pose for v in row) + "\n")


def inspected(unimapper, recording):
    command = [unimapper, "inspect", "--json", recording]
    return json.loads(subprocess.run(command, capture_output=True, check=True).stdout)


def said_live(program, recording):
    """Of each part that is said: when, seconds."""
    lines = subprocess.run([program, recording], capture_output=True, check=True, text=True).stdout.splitlines()
    return [(line.split()[0], float(line.split()[1]), line) for line in lines]


def live(program, folder, kind, value, drives):
    names = {"late": ("delay",), "inverted": ("motion",), "camera": ("motion",), "mirror": ("motion",),
             "scale": ("scale",) if 0.5 < value < 2.0 else ("motion",)}
    said, seconds = 0, []
    for name in drives:
        with tempfile.TemporaryDirectory() as target:
            make(os.path.join(folder, name), target, kind, value)
            found = said_live(program, target)
        said += bool(found)
        true = [at for part, at, _ in found if part in names.get(kind, (kind,))]
        seconds += true[:1]
        if os.environ.get("VERBOSE"):
            print(name, kind, value, *(line for _, _, line in found), sep=" | ", file=sys.stderr, flush=True)
    if kind == "none":
        return " | ".join(str(c) for c in [len(drives), said, "", "", ""])
    times = ["%.0f s" % quantile(seconds, 0.5), "%.0f s" % max(seconds)] if seconds else ["", ""]
    return " | ".join(str(c) for c in [len(drives), said, len(seconds), *times])


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def limits_of(unimapper, folder, check, drives):
    """Cells of a check; what `inspect` says of right drives is kept in FOLDER-right.json."""
    kept = folder + "-right.json"
    if not os.path.exists(kept):
        found = {name: inspected(unimapper, os.path.join(folder, name))["checks"] for name in drives}
        with open(kept, "w") as out:
            json.dump(found, out)
    with open(kept) as given:
        found = [f for name, checks in json.load(given).items() if name in drives
                 for f in checks if f["check"] == check]
    if not found:
        return "|  |  |"
    def cell(key):
        known = [f[key] for f in found if f[key] is not None]
        return "%g" % max(known) if known else ""
    return " | ".join([found[0]["unit"], cell("suspicious_above"), cell("wrong_above"),
                       "%.3g" % max(abs(f["figure"]) for f in found)])


def main():
    unimapper, folder, kind, value = sys.argv[1:5]
    if kind == "limits":
        drives = sorted(n for n in os.listdir(folder) if n.split("-")[0] in sys.argv[5:])
        return print(limits_of(unimapper, folder, value, drives))
    value = float(value)
    keys = {"roll": "roll_deg", "pitch": "pitch_deg", "yaw": "yaw_deg", "x": "x_m", "y": "y_m",
            "late": "delay_s"}
    limits = {"roll": 0.5, "pitch": 0.5, "yaw": 0.5, "x": 0.3, "y": 0.3, "late": 0.03}
    drives = [name for name in sorted(os.listdir(folder)) if name.split("-")[0] in sys.argv[5:] and
              fnmatch.fnmatch(name, os.environ.get("DRIVES", "*"))]
    if os.environ.get("LIVE"):
        return print(live(os.environ["LIVE"], folder, kind, value, drives))
    said = refused = 0
    errors = []
    for name in drives:
        with tempfile.TemporaryDirectory() as target:
            make(os.path.join(folder, name), target, kind, value)
            found = inspected(unimapper, target)
        findings = [f for f in found["findings"] if f["severity"] != "fine"]
        said += bool(findings)
        refused += any(f["severity"] == "wrong" for f in findings)
        estimates = found["calibration"]
        if kind in keys and estimates["motions"] > 0:
            estimate, sigma = estimates[keys[kind]]
            if sigma < limits[kind]:
                errors.append(abs(estimate - value))
        if os.environ.get("VERBOSE"):
            print(name, kind, value, *(f"{k} {v[0]:+.2f}±{v[1]:.2f}" if k != "motions" else v
                                       for k, v in estimates.items()), found["up"],
                  *(f"{f['severity']} {f['check']}: {f['message'][:90]}" for f in findings),
                  file=sys.stderr, flush=True)
    digits = "%.3f s" if kind == "late" else "%.2f m" if kind in ("x", "y") else "%.2f°"
    cells = [digits % quantile(errors, share) for share in (0.5, 0.9)] if errors else ["", ""]
    shown = len(errors) if kind in keys else ""
    print(" | ".join(str(c) for c in [len(drives), said, refused, shown, *cells]))


main()
