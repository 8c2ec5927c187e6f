"""Corpus of wrong inputs, made from one right recording, and its replay through the tool

usage: corpus.py UNIMAPPER FOLDER [OPTION...]     (options of `unimapper simulate` for another drive)

Simulates a small drive, hands it over in several right forms and in some sixty wrong ones, runs
`unimapper onboard` on each and prints a table. An input is handled if it is refused (exit code
not 0) with a message that says what to do, or if a warning names the matter. It is harmless if it
is mapped and, against the drive's true labels, no more points are labelled wrong than of the right
recording (but for 2 % of those). Everything else is a silent failure. Exit code 1 where there is
one, or where a right form is refused, warned of or labelled otherwise.
"""
import array
import math
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

TOOL, ROOT = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
CAMERA = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
SCANS = 40
MORE_WRONG = 1.02  # times the points that the right recording has labelled wrong
MOVING, DYNAMIC = 252, 251  # least label of what moves in the truth; label of a run


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def transposed(a):
    return [list(row) for row in zip(*a)]


def inverse(pose):
    r = transposed(pose[0])
    return r, [-x for x in apply(r, pose[1])]


def compose(p, q):
    return product(p[0], q[0]), [x + y for x, y in zip(apply(p[0], q[1]), p[1])]


def quaternion(r):
    w = math.sqrt(max(1e-12, 1 + r[0][0] + r[1][1] + r[2][2])) / 2
    return [(r[2][1] - r[1][2]) / (4 * w), (r[0][2] - r[2][0]) / (4 * w),
            (r[1][0] - r[0][1]) / (4 * w), w]


def in_axes(axes):
    return lambda p: (product(product(axes, p[0]), transposed(axes)), apply(axes, p[1]))


def kitti(poses):
    return "".join(" ".join("%.12g" % x for row, t in zip(r, v) for x in row + [t]) + "\n"
                   for r, v in poses)


def tum(poses, stamps, w_first=False):
    text = ""
    for (r, t), stamp in zip(poses, stamps):
        q = quaternion(r)
        q = [q[3]] + q[:3] if w_first else q
        text += "%.9f " % stamp + " ".join("%.12g" % x for x in list(t) + q) + "\n"
    return text


class Recording:
    """A copy of the right recording; what is changed is written."""

    def __init__(self, base=None):
        if base is not None:
            self.scans, self.poses = [array.array("f", s) for s in base.scans], list(base.poses)
            self.stamps, self.names = list(base.stamps), list(base.names)
        self.poses_text, self.times_text, self.form = None, None, "kitti"
        self.options, self.scan_bytes = [], {}

    def scaled(self, k):
        self.scans = [array.array("f", (x if i % 4 == 3 else x * k for i, x in enumerate(s)))
                      for s in self.scans]

    def moved(self, poses):
        for s, (r, t) in zip(self.scans, poses):
            for k in range(0, len(s) - 3, 4):
                x, y, z = s[k:k + 3]
                for i in range(3):
                    s[k + i] = r[i][0] * x + r[i][1] * y + r[i][2] * z + t[i]

    def records(self, record):
        out = []
        for s in self.scans:
            t = array.array("f")
            for n, i in enumerate(range(0, len(s) - 3, 4)):
                t.extend(record(s[i], s[i + 1], s[i + 2], s[i + 3], n))
            out.append(t)
        self.scans = out

    def header(self, scan, pose):
        """What stands before the points of a scan in this form."""
        n = len(scan) // 4
        if self.form == "kitti":
            return ""
        if self.form == "ply":
            return ("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % n +
                    "".join("property float %s\n" % f for f in ("x", "y", "z", "intensity")) +
                    "end_header\n")
        q = quaternion(pose[0])
        view = list(pose[1]) + [q[3]] + q[:3] if self.form == "viewpoint" else [0, 0, 0, 1, 0, 0, 0]
        return ("VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
                "COUNT 1 1 1 1\nWIDTH %d\nHEIGHT 1\nVIEWPOINT %s\nPOINTS %d\nDATA binary\n"
                % (n, " ".join("%.12g" % x for x in view), n))

    def write(self, folder):
        place, extension = {"kitti": ("/scans", "bin"), "ply": ("", "ply"), "text": ("", "xyz")}.get(
            self.form, ("/pcd", "pcd"))
        os.makedirs(folder + place)
        for i, (name, scan, pose) in enumerate(zip(self.names, self.scans, self.poses)):
            if self.form == "text":
                data = "".join("%.9g %.9g %.9g %.9g\n" % tuple(scan[k:k + 4])
                               for k in range(0, len(scan) - 3, 4)).encode()
            else:
                data = self.header(scan, pose).encode() + self.scan_bytes.get(i, scan.tobytes())
            with open("%s%s/%s.%s" % (folder, place, name, extension), "wb") as f:
                f.write(data)
        if self.form == "viewpoint":
            return
        times = "".join("%.9f\n" % t for t in self.stamps)
        for name, text, own in (("poses.txt", self.poses_text, kitti(self.poses)),
                                ("times.txt", self.times_text, times)):
            text = own if text is None else text
            if text:
                with open(folder + "/" + name, "w") as f:
                    f.write(text)


def read_base(folder):
    r = Recording()
    r.names = sorted(n[:-4] for n in os.listdir(folder + "/scans"))
    r.scans = []
    for n in r.names:
        a = array.array("f")
        with open("%s/scans/%s.bin" % (folder, n), "rb") as f:
            a.frombytes(f.read())
        r.scans.append(a)
    rows = [[float(x) for x in l.split()] for l in open(folder + "/poses.txt")]
    r.poses = [([p[0:3], p[4:7], p[8:11]], [p[3], p[7], p[11]]) for p in rows]
    r.stamps = [float(l) for l in open(folder + "/times.txt")]
    return r


def cases(base):
    """(name, what the message must name, recording); a right form has no such words."""
    n = len(base.poses)
    by_text = sorted(range(n), key=str)

    def case(name, words, change):
        r = Recording(base)
        change(r)
        return name, words, r

    def put(name, value):
        """Gives the recording what `value` makes of it."""
        return lambda r: setattr(r, name, value(r))

    def poses(change):
        return put("poses", lambda r: change(r.poses))

    def each_pose(change):
        return poses(lambda p: [change(x) for x in p])

    def text(change):
        return put("poses_text", change)

    def stamps(change):
        return put("stamps", lambda r: [change(i, t) for i, t in enumerate(r.stamps)])

    def form(name):
        return put("form", lambda r: name)

    def stamps_as_names(r):
        r.names = ["%d" % round(1e9 * t) for t in r.stamps]
        r.poses_text = tum(r.poses, r.stamps)
        r.times_text = ""

    def both(*changes):
        def run(r):
            for c in changes:
                c(r)
        return run

    def names_as_text(r):
        r.names = ["%06d" % i for i in range(n)]
        r.scans = [r.scans[k] for k in by_text]

    def world(r):
        r.moved(r.poses)

    def in_file(values, scan=None):
        def run(r):
            for i in range(n) if scan is None else [scan]:
                r.scan_bytes[i] = values(r.scans[i].tobytes())
        return run

    def scale_points(k):
        return lambda r: r.scaled(k)

    def layout(record):
        return lambda r: r.records(record)

    def mirrored(axis):
        signs = [[(-1.0 if i == axis else 1.0) * x for x in row] for i, row in enumerate(IDENTITY)]
        return lambda r: r.moved([(signs, [0.0, 0.0, 0.0])] * n)

    half = lambda p: [p[i // 2] for i in range(n)]
    still = lambda p: [(IDENTITY, [0.0, 0.0, 0.0])] * n
    increments = lambda p: [p[0]] + [compose(inverse(a), b) for a, b in zip(p, p[1:])]
    scale = lambda k: each_pose(lambda p: (p[0], [k * x for x in p[1]]))

    turned = lambda deg: ([[math.cos(math.radians(deg)), -math.sin(math.radians(deg)), 0.0],
                           [math.sin(math.radians(deg)), math.cos(math.radians(deg)), 0.0],
                           [0.0, 0.0, 1.0]], [0.0, 0.0, 0.0])
    over = ([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]], [0.0, 0.0, 0.0])
    from_middle = lambda step: poses(lambda p: p[:n // 2] + [compose(step, x) for x in p[n // 2:]])
    utm = lambda p: (p[0], [a + b for a, b in zip(p[1], (448262.318, 5411904.557, 312.2))])

    right = [
        case("KITTI form", None, lambda r: None),
        case("names without leading zeros", None, put("names", lambda r: [str(i) for i in range(n)])),
        case("TUM poses with stamps", None, text(lambda r: tum(r.poses, r.stamps))),
        case("PCD with a pose file", None, form("pcd")),
        case("PCD in the world frame with viewpoints", None, both(world, form("viewpoint"))),
        case("carriage returns", None, text(lambda r: kitti(r.poses).replace("\n", "\r\n"))),
        case("TUM poses with decimal commas", None,
             text(lambda r: tum(r.poses, r.stamps).replace(" ", ";").replace(".", ","))),
        case("stamps of today", None, stamps(lambda i, t: t + 1.7e9)),
        case("PLY beside a pose file", None, form("ply")),
        case("text beside a pose file", None, form("text")),
        case("names that are stamps, TUM poses", None, both(
            stamps(lambda i, t: t + 1.7e9), stamps_as_names)),
    ]
    wrong = [
        case("scans renamed in the order of text", "order|late|early", names_as_text),
        case("poses in the order of text", "order|late|early", poses(lambda p: [p[k] for k in by_text])),
        case("PCD without poses", "pose|VIEWPOINT", both(form("pcd"), text(lambda r: ""))),
        case("poses at half the rate, repeated", "own stamp", poses(half)),
        case("five times as many poses", "pose|stamp",
             text(lambda r: kitti([p for p in r.poses for _ in range(5)]))),
        case("quaternions with w first", "qx qy qz qw", text(lambda r: tum(r.poses, r.stamps, True))),
        case("records of five floats", "float|record|bytes",
             layout(lambda x, y, z, i, k: (x, y, z, i, float(k % 16)))),
        case("records of three floats", "float|record|bytes", layout(lambda x, y, z, i, k: (x, y, z))),
        case("records of six floats", "float|record|bytes",
             layout(lambda x, y, z, i, k: (x, y, z, i, float(k % 16), 0.1))),
        case("records of eight floats", "float|record|bytes",
             layout(lambda x, y, z, i, k: (x, y, z, 1.0, i, 0.0, 0.0, 0.0))),
        case("points in millimetres", "milli", scale_points(1000.0)),
        case("points in centimetres", "centi", scale_points(100.0)),
        case("points in kilometres", "kilo", scale_points(0.001)),
        case("points and poses in millimetres", "milli|metres", both(scale_points(1000.0), scale(1000.0))),
        case("points in feet", "feet|units", scale_points(3.28)),
        case("poses in millimetres", "metres", scale(1000.0)),
        case("poses in centimetres", "metres", scale(100.0)),
        case("poses in kilometres", "kilometres|1000", scale(0.001)),
        case("poses half as long again", "units", scale(1.5)),
        case("inverted poses", "invert", each_pose(inverse)),
        case("transposed rotations", "row by row", each_pose(lambda p: (transposed(p[0]), p[1]))),
        case("camera poses without calibration", "calib", each_pose(in_axes(CAMERA))),
        case("poses in NED", "NED", each_pose(in_axes([[1, 0, 0], [0, -1, 0], [0, 0, -1]]))),
        case("left-handed poses", "handed|negate y", each_pose(in_axes([[1, 0, 0], [0, -1, 0], [0, 0, 1]]))),
        case("points mirrored along y", "negate y", mirrored(1)),
        case("points mirrored along x", "negate x", mirrored(0)),
        case("points mirrored along z", "negate z", mirrored(2)),
        case("poses of a body turned by 90 degrees", "extrinsic",
             each_pose(in_axes([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))),
        case("poses of a body turned by 180 degrees", "extrinsic|invert|reversed",
             each_pose(in_axes([[-1, 0, 0], [0, -1, 0], [0, 0, 1]]))),
        case("increments instead of poses", "accumulate", poses(increments)),
        case("all poses at the origin", "stand still", poses(still)),
        case("positions missing", "stand still", each_pose(lambda p: (p[0], [0.0, 0.0, 0.0]))),
        case("rotations missing", "motion|roll and pitch", each_pose(lambda p: (IDENTITY, p[1]))),
        case("poses reversed", "reversed", poses(lambda p: p[::-1])),
        case("poses three scans late", "early|late", poses(lambda p: [p[0]] * 3 + p[:-3])),
        case("poses ten scans early", "early|late", poses(lambda p: p[10:] + [p[-1]] * 10)),
        case("poses shuffled", "order", poses(lambda p: [p[(17 * i) % n] for i in range(n)])),
        case("scans in the world frame", "world frame|inverse of its pose", world),
        case("scans in the world frame, no poses", "world frame", both(world, poses(still))),
        case("coordinates of a map", "frame",
             lambda r: r.moved([(IDENTITY, [4e5, 5e6, 50.0])] * n)),
        case("points with y up", "z up", lambda r: r.moved([([[1, 0, 0], [0, 0, 1], [0, -1, 0]], [0, 0, 0])] * n)),
        case("stamps in milliseconds", "millisecond", stamps(lambda i, t: 1e3 * t)),
        case("stamps in nanoseconds", "second|range", put("times_text", lambda r: "".join("%d\n" % (1e9 * t) for t in r.stamps))),
        case("stamps all equal", "stamp", stamps(lambda i, t: 1.0)),
        case("stamps reversed", "stamp", put("stamps", lambda r: r.stamps[::-1])),
        case("two stamps exchanged", "stamp", stamps(lambda i, t: t + (0.1 if i == 9 else -0.1 if i == 10 else 0))),
        case("fewer poses than scans", "pose", text(lambda r: kitti(r.poses[:-4]))),
        case("no poses at all", "pose", text(lambda r: "")),
        case("Euler angles", "columns", text(lambda r: "".join("%g %g %g 0 0 0\n" % tuple(p[1]) for p in r.poses))),
        case("four by four matrices", "columns", text(lambda r: "".join(
            l + " 0 0 0 1\n" for l in kitti(r.poses).splitlines()))),
        case("a header of other names", "columns", text(lambda r: "tx ty tz qx qy qz qw t\n" + tum(r.poses, r.stamps))),
        case("a pose that is NaN", "finite", text(lambda r: kitti(r.poses).replace("\n", "\n" + "nan " * 12 + "\n", 1))),
        case("a scan cut short", "truncated|bytes", in_file(lambda b: b[:-3], 7)),
        case("scans of zeros", "points|zero", in_file(lambda b: bytes(len(b)))),
        case("every scan twice", "repeat", lambda r: r.scans.__setitem__(
            slice(None), [r.scans[i // 2 * 2] for i in range(n)])),
        case("odometry that starts anew", "session of its own", poses(
            lambda p: p[:n // 2] + [compose(inverse(p[n // 2]), x) for x in p[n // 2:]])),
        case("odometry that jumps by 2 m", "session of its own", from_middle((IDENTITY, [0.0, 2.0, 0.0]))),
        case("odometry that rises by 1.5 m", "session of its own", from_middle((IDENTITY, [0.0, 0.0, 1.5]))),
        case("poses of a body turned by 5 degrees", "extrinsic",
             each_pose(lambda p: compose(p, turned(5)))),
        case("poses of a body turned by 40 degrees", "extrinsic",
             each_pose(lambda p: compose(p, turned(40)))),
        case("a LiDAR upside down", "upside down|extrinsic|negate", lambda r: (
            r.moved([over] * n), setattr(r, "poses", [compose(compose(over, p), over) for p in r.poses]))),
        case("poses in UTM", "origin", each_pose(utm)),
        case("poses in UTM with six digits", "digits|motion|stand|metres|motions", text(lambda r: "".join(
            " ".join("%g" % x for row, t in zip(*utm(p)) for x in row + [t]) + "\n" for p in r.poses))),
        case("earth-centred poses", "ECEF", each_pose(
            lambda p: (p[0], [a + b for a, b in zip(p[1], (4160000.5, 660000.25, 4780000.75))]))),
        case("a clock that steps by half a second", "clock|late|session of its own",
             poses(lambda p: p[:n // 2] + [p[i - 5] for i in range(n // 2, n)])),
        case("positions with a yaw", "angles", text(lambda r: "".join(
            "%g %g %g %g\n" % (*p[1], math.atan2(p[0][1][0], p[0][0][0])) for p in r.poses))),
        case("a sensor that is none", "did you mean", put("options", lambda r: ["--sensor", "vlp-61"])),
    ]
    return right, wrong


def labels(folder):
    data = b""
    if os.path.isdir(folder + "/labels"):
        for name in sorted(os.listdir(folder + "/labels"), key=lambda n: (len(n), n)):
            with open(folder + "/labels/" + name, "rb") as f:
                data += f.read()
    return data


def differ(a, b):
    """Share of the points whose labels differ; 1 where the files do not fit each other."""
    if len(a) != len(b) or not a:
        return 1.0
    a, b = array.array("I", a), array.array("I", b)
    return sum(x != y for x, y in zip(a, b)) / len(a)


def wrong_points(found, truth):
    """How many points are labelled wrong; infinitely many where the labels do not fit."""
    if len(found) != len(truth) or not found:
        return math.inf
    found, truth = array.array("I", found), array.array("I", truth)
    return sum((a == DYNAMIC) != ((b & 0xffff) >= MOVING) for a, b in zip(found, truth))


def run(index, recording):
    folder, out = "%s/%02d" % (ROOT, index), "%s/%02d-run" % (ROOT, index)
    recording.write(folder)
    options = recording.options or ["--sensor", "vlp-16"]
    done = subprocess.run([TOOL, "onboard", folder, "--out", out] + options, capture_output=True,
                          text=True)
    result = done.returncode, done.stderr, labels(out)
    shutil.rmtree(folder)
    shutil.rmtree(out, ignore_errors=True)
    return result


def said(stderr):
    """Errors and warnings about the input."""
    return [l for l in stderr.splitlines() if "unimapper: error: " in l or "warning: input" in l or
            "warning: roll and pitch" in l or " refused: " in l or "are truncated" in l]


def names_it(lines, words):
    return any(word.lower() in line.lower() for line in lines for word in words.split("|"))


def main():
    shutil.rmtree(ROOT, ignore_errors=True)
    os.makedirs(ROOT)
    drive = sys.argv[3:] or ["--scene", "hall", "--seed", "2"]
    subprocess.run([TOOL, "simulate", "--sensor", "vlp-16", "--scans", str(SCANS), "--thin", "4",
                    "--out", ROOT + "/base"] + drive, check=True, capture_output=True)
    base, truth = read_base(ROOT + "/base"), labels(ROOT + "/base")
    right, wrong = cases(base)
    with ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda c: run(c[0], c[1][2]), enumerate(right + wrong)))
    reference = results[0][2]
    usual = wrong_points(reference, truth)
    failures = 0
    print("| input | exit code | outcome | labels that differ | labels that are wrong | message |\n|---|---|---|---|---|---|")
    for (name, words, _), (code, stderr, found) in zip(right + wrong, results):
        lines = said(stderr)
        off, bad = differ(reference, found), wrong_points(found, truth)
        if words is None:
            outcome = "right" if code == 0 and not lines and off == 0.0 else "FALSE ALARM"
        elif names_it(lines, words):
            outcome = "refused" if code != 0 else "warned"
        elif code != 0:
            outcome = "REFUSED WITHOUT REMEDY"
        elif bad <= MORE_WRONG * usual:
            outcome = "harmless"
        else:
            outcome = "SILENT FAILURE"
        failures += outcome.isupper()
        message = lines[-1].replace("|", "/").replace(ROOT, "")[:160] if lines else ""
        mapped = "%.2f %% | %.2f %%" % (100 * off, 400 * bad / len(truth)) if code == 0 and bad < math.inf else " | "
        print("| %s | %d | %s | %s | %s |" % (name, code, outcome, mapped, message))
    print("%d right forms, %d wrong ones, %d failures" % (len(right), len(wrong), failures))
    shutil.rmtree(ROOT, ignore_errors=True)
    sys.exit(1 if failures else 0)


main()
