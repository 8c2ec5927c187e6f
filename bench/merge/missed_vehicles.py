#!/usr/bin/env python3
"""Picture of changed vehicles that a map does not show.

  missed_vehicles.py RESULT MAP SESSION=DATASET TWICE PNG

RESULT: what `unimapper evaluate changes` said of MAP. From above, a row for each vehicle: the earlier
session's points, the later one's, and those that count as changed; the vehicle's true box in red.
"""
import json
import math
import struct
import sys
import zlib

from overlap_error import estimated, seen_from, true

HALF_M = 6.0
CELLS = 240
GAP = 8
WHITE, BLACK, RED, BLUE = (255, 255, 255), (60, 60, 60), (210, 30, 30), (30, 90, 200)


def points(path):
    """x, y and z of every vertex of a binary PLY."""
    content = open(path, "rb").read()
    begin = content.index(b"end_header\n") + 11
    sizes = {"float": 4, "uchar": 1, "ushort": 2, "uint": 4}
    lines = [line.split() for line in content[:begin].decode().splitlines()]
    stride = sum(sizes[line[1]] for line in lines if line[0] == "property")
    for offset in range(begin, len(content) - stride + 1, stride):
        yield struct.unpack_from("<3f", content, offset)


def alignment(folder, name, dataset, centre):
    """The pose of a session's keyframe nearest to a true position, in the map and in truth."""
    poses = estimated(f"{folder}/trajectories/{name}.tum")
    truth = true(dataset, list(poses))
    i = min(range(len(truth)), key=lambda k: math.dist(truth[k][1], centre))
    return list(poses.values())[i], truth[i]


def top_view(cloud, at, box):
    """Rows of pixels around a box, whose axes are those of the picture."""
    estimate, truth = at
    pixels = [[WHITE] * CELLS for _ in range(CELLS)]
    cos, sin = math.cos(box["yaw"]), math.sin(box["yaw"])

    def pixel(x, y):
        return int((y + HALF_M) / (2 * HALF_M) * CELLS), int((x + HALF_M) / (2 * HALF_M) * CELLS)

    for point in cloud:
        local = seen_from(estimate, point)
        x, y, z = (sum(truth[0][i][k] * local[k] for k in range(3)) + truth[1][i] - box["centre"][i]
                   for i in range(3))
        x, y = cos * x + sin * y, cos * y - sin * x
        # Above the ground, below roofs.
        if max(abs(x), abs(y)) >= HALF_M or abs(z) > 0.5 * box["size"][2] - 0.2:
            continue
        row, column = pixel(x, y)
        for r in (row, min(row + 1, CELLS - 1)):
            for c in (column, min(column + 1, CELLS - 1)):
                pixels[r][c] = BLACK
    a, b = (0.5 * size for size in box["size"][:2])
    for i in range(CELLS):
        share = 2.0 * i / CELLS - 1.0
        for x, y in ((a * share, b), (a * share, -b), (a, b * share), (-a, b * share)):
            row, column = pixel(x, y)
            pixels[row][column] = RED
    return pixels


def png(rows):
    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    body = b"".join(b"\0" + bytes(value for pixel in row for value in pixel) for row in rows)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(body, 9)) +
            chunk(b"IEND", b""))


def main():
    result, folder, earlier, later, out = sys.argv[1:]
    sessions = [argument.split("=", 1) for argument in (earlier, later)]
    clouds = [list(points(f"{folder}/clouds/{name}.ply")) for name, _ in sessions]
    clouds.append(list(points(f"{folder}/changes.ply")))
    picture = []
    for missed in json.load(open(result))["missed"]:
        box = missed["box"]
        at = [alignment(folder, name, dataset, box["centre"]) for name, dataset in sessions]
        views = [top_view(cloud, at[min(i, 1)], box) for i, cloud in enumerate(clouds)]
        picture += [[BLUE] * (3 * CELLS + 2 * GAP)] * (GAP if picture else 0)
        for row in range(CELLS):
            picture.append(views[0][row] + [BLUE] * GAP + views[1][row] + [BLUE] * GAP + views[2][row])
    open(out, "wb").write(png(picture))


main()
