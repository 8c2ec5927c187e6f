"""LAS files of a map, read by the ASPRS LAS 1.4 specification (revision 15): read_las.py TOOL."""
import json
import math
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

# Table 3: the public header block, and the fields of table 8: point data record format 6.
HEADER = struct.Struct("<4s2H16s2B32s32s2HH2IBHI5I6d6dQQIQ15Q")
RECORD = struct.Struct("<H16s2H32s")  # table 7: the header of a variable length record
POINT = struct.Struct("<3iH4BhHd")


def text(field):
    """A null-terminated text whose rest is null, too."""
    value, _, rest = field.partition(b"\0")
    assert not rest.strip(b"\0"), field
    return value.decode("ascii")


def read_las(path):
    """Points (x, y, z, intensity, class, user data, source) and the coordinate system's WKT."""
    data = path.read_bytes()
    (signature, _, encoding, _, major, minor, _, software, day, year, header_bytes, points_at,
     records, form, point_bytes, legacy_count, *rest) = HEADER.unpack_from(data)
    scale, offset, bounds = rest[5:8], rest[8:11], rest[11:17]
    waveforms_at, extended_at, extended, count, *by_return = rest[17:]
    assert (signature, major, minor, header_bytes) == (b"LASF", 1, 4, HEADER.size)
    assert text(software) and 1 <= day <= 366 and year >= 1970
    assert encoding & 0x10, "formats from 6 on name their system as WKT"
    assert (form, point_bytes) == (6, POINT.size)
    assert legacy_count == 0 and not any(rest[:5]), "format 6 has no legacy counts"
    assert (waveforms_at, extended_at, extended) == (0, 0, 0)
    assert sum(by_return) == count and len(data) == points_at + count * point_bytes

    wkt, at = None, header_bytes
    for _ in range(records):
        _, user, number, length, _ = RECORD.unpack_from(data, at)
        at += RECORD.size
        if (text(user), number) == ("LASF_Projection", 2112):
            wkt = text(data[at:at + length])
        at += length
    assert at == points_at

    points, returns = [], [0] * 15
    for x, y, z, intensity, number, _, kind, user, _, source, _ in POINT.iter_unpack(
            data[points_at:]):
        assert 1 <= number & 15 <= number >> 4, "a return is one of its ray's"
        returns[(number & 15) - 1] += 1
        place = [i * s + o for i, s, o in zip((x, y, z), scale, offset)]
        points.append((*place, intensity, kind, user, source))
    assert returns == by_return
    for axis in range(3):
        values = [point[axis] for point in points]
        high, low = bounds[2 * axis:2 * axis + 2]
        assert math.isclose(max(values), high, abs_tol=1e-6), (axis, high)
        assert math.isclose(min(values), low, abs_tol=1e-6), (axis, low)
    return points, wkt


def read_ply(path):
    """The same points as map.ply has them, in the map's frame."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    kinds = {"float": "f", "uchar": "B", "ushort": "H"}
    properties = [line.split()[1:] for line in header.decode().splitlines()
                  if line.startswith("property")]
    names = [name for _, name in properties]
    values = struct.Struct("<" + "".join(kinds[kind] for kind, _ in properties)).iter_unpack(body)
    return [dict(zip(names, value)) for value in values]


def main(tool):
    """Maps a drive with a known position and compares."""
    def run(*words):
        subprocess.run([tool, *map(str, words)], check=True, capture_output=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run("simulate", "--sensor", "vlp-16", "--scans", 20, "--thin", 8, "--out", folder / "drive")
        run("onboard", folder / "drive", "--out", folder / "run")
        (folder / "run/positions.csv").write_text(
            "keyframe,x,y,z,sigma_xy,sigma_z\n0,691234.5,5335678.25,512,0.1,0.1\n")
        run("merge", folder / "run", "--las", "--tile", 20, "--crs", "EPSG:25832", "--out",
            folder / "map")
        points, wkt = read_las(folder / "map/map.las")
        assert wkt.startswith('PROJCS["ETRS89 / UTM zone 32N"'), wkt
        origin = json.loads((folder / "map/georeference.json").read_text())["origin"]
        expected = read_ply(folder / "map/map.ply")
        assert len(points) == len(expected) > 1000
        for point, ply in zip(points, expected):
            place = [ply[axis] + shift for axis, shift in zip("xyz", origin)]
            assert math.dist(point[:3], place) < 0.001, (point, ply)
            assert point[3] == 257 * ply["intensity"]
            assert point[4] in (1, 2) and point[5:] == (ply["sessions_seen"], ply["session"] + 1)
        assert {point[4] for point in points} == {1, 2} and max(point[3] for point in points) > 0
        tiles = [read_las(tile)[0] for tile in sorted((folder / "map/tiles").glob("*.las"))]
        assert len(tiles) > 1 and sorted(sum(tiles, [])) == sorted(points)


if __name__ == "__main__":
    main(sys.argv[1])
