#!/usr/bin/env python3
"""Cells of a row of bench/faults/run.sh: what robots published against what the base has.

  outcome.py STORE PEAKS ROBOT...

A ROBOT is what fault_robot printed, or the run folder of `unimapper onboard`. Keyframes are compared by
sequence, size and checksum: one with other bytes is another. Reads the store's table, the bytes of
the event log and nothing of the library that wrote them.
"""
import collections
import os
import re
import sqlite3
import struct
import sys
import zlib

CAUGHT_UP = 2  # keyframes that are on their way in any case
EVENT = struct.Struct(">IqqII")
EVENT_MAGIC = 0xEDA1DA01
CHUNK = struct.Struct(">QiiqqIIIIII")  # chunk_t.lcm up to its data, behind the fingerprint


def stored(folder):
    """How often the base has each keyframe."""
    with sqlite3.connect(f"{folder}/store.sqlite") as database:
        rows = database.execute("SELECT sequence, bytes FROM keyframes")
        return collections.Counter((sequence, len(data), zlib.crc32(data)) for sequence, data in rows)


def in_log(path):
    """Keyframes that are whole in an event log."""
    with open(path, "rb") as file:
        log = file.read()
    pieces = collections.defaultdict(set)
    at = 0
    while at + EVENT.size <= len(log):
        magic, _, _, channel_bytes, size = EVENT.unpack_from(log, at)
        at += EVENT.size
        if magic != EVENT_MAGIC or at + channel_bytes + size > len(log):
            break
        if log[at:at + channel_bytes] == b"UNIMAPPER_KEYFRAME":
            *_, sequence, index, count, total, checksum, _ = CHUNK.unpack_from(log, at + channel_bytes)
            pieces[sequence, total, checksum, count].add(index)
        at += channel_bytes + size
    return [key[:3] for key, found in pieces.items() if len(found) == key[3]]


def catch_up_s(samples):
    """Seconds from the last time that most keyframes waited until few did; None if more did to the end.

    Samples: seconds, and the keyframes that wait for their acknowledgement.
    """
    most, since_s, took_s = 0, 0.0, None
    for now_s, waiting in samples:
        if waiting >= most:
            most, since_s, took_s = waiting, now_s, None
        if waiting <= CAUGHT_UP and took_s is None:
            took_s = now_s - since_s
    return took_s


def read_robot(path):
    """Keyframes published, keyframes acknowledged, samples."""
    if os.path.isdir(path):
        acknowledged = 0
        if os.path.exists(f"{path}/stats.json"):
            with open(f"{path}/stats.json", encoding="utf-8") as file:
                # The first is this session's, those below are of its parts and of earlier sessions.
                found = re.search(r'"keyframes_acknowledged": *(\d+)', file.read())
                acknowledged = int(found[1]) if found else 0
        return in_log(f"{path}/keyframes.lcmlog"), acknowledged, []
    published, acknowledged, samples = [], 0, []
    with open(path, encoding="utf-8") as file:
        for word, *numbers in map(str.split, file):
            if word == "published":
                published.append((int(numbers[0]), int(numbers[1]), int(numbers[2], 16)))
            elif word == "acknowledged":
                acknowledged = int(numbers[0])
            elif word == "waiting":
                samples.append((float(numbers[0]), int(numbers[1])))
    return published, acknowledged, samples


def outcome(at_base, robots):
    """Keyframes sent, stored, lost, duplicated, falsely reported, and the longest time to catch up."""
    sent = here = duplicated = falsely = 0
    times = []
    for published, acknowledged, samples in robots:
        copies = [at_base[name] for name in published if name in at_base]
        sent += len(published)
        here += len(copies)
        duplicated += sum(copies) - len(copies)
        falsely += max(0, acknowledged - len(copies))
        if samples:
            times.append(catch_up_s(samples))
    longest = "–" if not times else "never" if None in times else f"{max(times):.1f}"
    return sent, here, sent - here, duplicated, falsely, longest


def main():
    *counts, longest = outcome(stored(sys.argv[1]), map(read_robot, sys.argv[3:]))
    if counts[0] == 0:
        sys.exit("error: no robot published a keyframe")
    print(*counts, sys.argv[2], longest, sep=" | ", end="")


if __name__ == "__main__":
    main()
