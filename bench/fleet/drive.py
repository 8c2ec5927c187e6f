#!/usr/bin/env python3
"""Processes of run.sh and the cells of its table.

  drive.py BIN OUT ROBOTS SITES KEYFRAMES SECONDS SEED
"""
import ctypes
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time

BIN, OUT = sys.argv[1:3]
ROBOTS, SITES, KEYFRAMES, SECONDS, SEED = map(int, sys.argv[3:])
PORT = 4222
DRAIN_S = 120
processes = {}
spent_s = {}


def die_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)


def start(name, command):
    log = open(f"{OUT}/{name}.log", "a")
    processes[name] = subprocess.Popen(command, stdout=log, stderr=log, preexec_fn=die_with_parent)


def end(name, number):
    """Ends one of the processes by its number and counts its processor time."""
    child = processes.pop(name)
    child.send_signal(number)
    _, _, usage = os.wait4(child.pid, 0)
    child.returncode = 0
    part = name.split("-")[0]
    spent_s[part] = spent_s.get(part, 0.0) + usage.ru_utime + usage.ru_stime


def url(site):
    return f"udpm://239.255.76.67:{7667 + site}?ttl=0"


def start_part(name):
    tool = f"{BIN}/unimapper"
    nats = f"nats://127.0.0.1:{PORT}"
    if name == "server":
        start(name, ["nats-server", "-js", "-a", "127.0.0.1", "-p", str(PORT), "-sd", f"{OUT}/stream"])
    elif name == "centre":
        start(name, [tool, "base", "--store", f"{OUT}/centre", "--from", nats])
    else:
        site = int(name.split("-")[1])
        start(name, [tool, "base", "--store", f"{OUT}/{name}", "--listen", url(site), "--uplink", nats,
                     "--site", name])


def keyframes(store):
    """Every keyframe of a store with its checksum."""
    with sqlite3.connect(f"file:{OUT}/{store}/store.sqlite?mode=ro", uri=True) as database:
        return database.execute("SELECT hex(identity), sequence, crc32 FROM keyframes JOIN sessions ON id = session"
                                ).fetchall()


def at_sites():
    return [row for site in range(SITES) for row in keyframes(f"site-{site}")]


def main():
    shutil.rmtree(OUT, ignore_errors=True)
    os.makedirs(OUT)
    dice = random.Random(SEED)
    parts = ["server", "centre"] + [f"site-{site}" for site in range(SITES)]
    for name in parts:
        start_part(name)
    for robot in range(ROBOTS):
        start(f"robot-{robot}", [f"{BIN}/fault_robot", url(robot % SITES), f"robot{robot}",
                                 "--keyframes", str(KEYFRAMES), "--seed", str(SEED + robot),
                                 "--period-ms", str(1000.0 * SECONDS / KEYFRAMES), "--waits"])
    kills = 0
    begin = time.monotonic()
    while time.monotonic() < begin + SECONDS:
        time.sleep(dice.uniform(0.5, 1.5))
        name = dice.choice(parts)
        end(name, signal.SIGKILL)
        kills += 1
        time.sleep(dice.uniform(0.0, 0.5))
        start_part(name)
    for robot in range(ROBOTS):
        processes[f"robot-{robot}"].wait(DRAIN_S)
    calm = time.monotonic()
    while time.monotonic() < calm + DRAIN_S and len(keyframes("centre")) < len(at_sites()):
        time.sleep(0.1)
    drained_s = time.monotonic() - calm
    for name in [one for one in processes if not one.startswith("robot")][::-1]:
        end(name, signal.SIGKILL if name == "server" else signal.SIGTERM)
    sent, taken = at_sites(), keyframes("centre")
    lost = len(set(sent) - set(taken)) + ROBOTS * KEYFRAMES - len(sent)
    twice = len(taken) - len(set((row[0], row[1]) for row in taken))
    each_ms = {part: 1000.0 * spent / max(1, len(taken)) for part, spent in spent_s.items()}
    print(f"{len(sent)} | {kills} | {lost} | {twice} | {drained_s:.1f} "
          f"| {each_ms['site']:.1f} | {each_ms['server']:.1f} | {each_ms['centre']:.1f}")
    return 1 if lost or twice else 0


sys.exit(main())
