#!/usr/bin/env python3
"""Cells of a row of run.sh: a merge by workers, all of which are killed (-9) again and again.

  merge_kills.py BIN OUT RUNS WORKERS KILLS SEED

Half of the kills end the merge, the others a worker; what is killed is started again.
"""
import random
import signal
import subprocess
import sys
import time

from processes import Fleet, contents, empty

BIN, OUT, RUNS = sys.argv[1:4]
WORKERS, KILLS, SEED = map(int, sys.argv[4:])
LONGEST_S = 600


def quietly(tool, *words):
    subprocess.run([tool, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def prepare(fleet, store):
    quietly(fleet.tool, "map", "create", "--store", store)
    quietly(fleet.tool, "map", "add", "--store", store, *(f"{RUNS}_{route}" for route in "ABC"))


def main():
    empty(OUT)
    fleet = Fleet(BIN, OUT)
    dice = random.Random(SEED)
    for store in "alone", "killed":
        prepare(fleet, f"{OUT}/{store}")
    quietly(fleet.tool, "map", "merge", "--store", f"{OUT}/alone", "--threads", "1")
    fleet.start_servers()
    for worker in range(WORKERS):
        fleet.start(f"worker-{worker}", [fleet.tool, "worker", "--nats", fleet.url, "--threads", "1"])
    merge = [fleet.tool, "map", "merge", "--store", f"{OUT}/killed", "--threads", "1", "--workers", fleet.url]
    fleet.start("centre", merge)
    merges = kills = 0
    end = time.monotonic() + LONGEST_S
    while time.monotonic() < end:
        pause = time.monotonic() + (dice.uniform(0.1, 1.5) if kills < KILLS else 1e9)
        while fleet.processes["centre"].poll() is None and time.monotonic() < min(pause, end):
            time.sleep(0.02)
        if fleet.processes["centre"].returncode is not None:
            break
        name = dice.choice(["centre", f"worker-{dice.randrange(WORKERS)}"])
        fleet.end(name, signal.SIGKILL)
        fleet.start(name)
        kills += 1
        merges += name == "centre"
    has_ended = fleet.processes.pop("centre").returncode == 0
    fleet.end_all()
    for store in "alone", "killed":
        quietly(fleet.tool, "map", "export", "--store", f"{OUT}/{store}", "--out", f"{OUT}/map_{store}")
    same = has_ended and contents(f"{OUT}/map_alone") == contents(f"{OUT}/map_killed")
    print(f"{kills} | {merges} | {'yes' if same else 'NO'}")
    return 0 if same else 1


sys.exit(main())
