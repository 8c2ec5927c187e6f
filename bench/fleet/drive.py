#!/usr/bin/env python3
"""Cells of a row of run.sh: sites to a centre while parts of it are killed.

  drive.py BIN OUT --robots N --sites N --keyframes N --seconds S --seed N
           [--servers N --server-kill-s S] [--cut-s S]

About every second a base, or the only server, is killed (-9) and started again. Of several servers
one is killed every --server-kill-s. --cut-s: the first site reaches them by a leaf node, whose link
is cut for so long from a quarter of the time on.
"""
import argparse
import random
import signal
import sys
import time

from processes import Fleet, empty, lcm_url

DRAIN_S = 180


def arguments():
    parser = argparse.ArgumentParser()
    parser.add_argument("binaries")
    parser.add_argument("out")
    for name, value in ("robots", 20), ("sites", 3), ("keyframes", 30), ("seconds", 30), ("seed", 1), \
            ("servers", 1), ("server-kill-s", 0), ("cut-s", 0):
        parser.add_argument(f"--{name}", type=int, default=value)
    return parser.parse_args()


def kill_some(fleet, given, dice):
    """Kills for the given time; returns how often."""
    bases = ["centre"] + [f"site-{site}" for site in range(given.sites)]
    servers = [f"server-{i}" for i in range(given.servers)]
    often = bases + (servers if given.servers == 1 else [])
    kills = 0
    begin = time.monotonic()
    next_server = begin + given.server_kill_s
    cut_at = begin + given.seconds / 4
    while time.monotonic() < begin + given.seconds:
        time.sleep(dice.uniform(0.5, 1.5))
        if given.cut_s and cut_at < time.monotonic() < cut_at + given.cut_s:
            fleet.cut_link()
        elif given.cut_s and time.monotonic() > cut_at + given.cut_s:
            fleet.mend_link()
        name = dice.choice(often)
        if given.server_kill_s and time.monotonic() > next_server:
            name = dice.choice(servers)
            next_server += given.server_kill_s
        fleet.end(name, signal.SIGKILL)
        kills += 1
        time.sleep(dice.uniform(0.0, 0.5))
        fleet.start(name)
    fleet.mend_link()
    return kills


def main():
    given = arguments()
    empty(given.out)
    fleet = Fleet(given.binaries, given.out, given.servers, given.cut_s > 0)
    fleet.start_servers()
    fleet.start_centre()
    for site in range(given.sites):
        fleet.start_site(site, fleet.leaf_url if given.cut_s and site == 0 else fleet.url)
    for robot in range(given.robots):
        fleet.start(f"robot-{robot}",
                    [f"{given.binaries}/fault_robot", lcm_url(robot % given.sites), f"robot{robot}",
                     "--keyframes", str(given.keyframes), "--seed", str(given.seed + robot),
                     "--period-ms", str(1000.0 * given.seconds / given.keyframes), "--waits"])
    kills = kill_some(fleet, given, random.Random(given.seed))
    for robot in range(given.robots):
        fleet.wait(f"robot-{robot}", DRAIN_S)
    drained_s = fleet.drain(given.sites, DRAIN_S)
    fleet.end_all()
    sent, lost, twice = fleet.compare(given.sites)
    lost += given.robots * given.keyframes - sent
    each_ms = {part: 1000.0 * spent / max(1, sent) for part, spent in fleet.spent_s.items()}
    print(f"{sent} | {kills} | {lost} | {twice} | {drained_s:.1f} "
          f"| {each_ms['site']:.1f} | {each_ms['server']:.1f} | {each_ms['centre']:.1f}")
    return 1 if lost or twice else 0


sys.exit(main())
