#!/usr/bin/env python3
"""Cells of a row of run.sh: as many robots as asked for, each a stored keyframe a second.

  load.py BIN OUT STORE ROBOTS SITES SECONDS
"""
import re
import sys
import time

from processes import Fleet, empty, lcm_url

BIN, OUT, STORE = sys.argv[1:4]
ROBOTS, SITES, SECONDS = map(int, sys.argv[4:])
DRAIN_S = 240


def main():
    empty(OUT)
    fleet = Fleet(BIN, OUT)
    fleet.start_servers()
    fleet.start_centre()
    for site in range(SITES):
        fleet.start_site(site, fleet.url)
    begin = time.monotonic()
    first = 0
    for site in range(SITES):
        robots = (ROBOTS + SITES - 1 - site) // SITES
        fleet.start(f"robot-{site}", [f"{BIN}/fleet_robots", lcm_url(site), STORE, "--first", str(first),
                                      "--robots", str(robots), "--keyframes", str(SECONDS)])
        first += robots
    late_s = 0.0
    for site in range(SITES):
        fleet.wait(f"robot-{site}", SECONDS + DRAIN_S)
        with open(f"{OUT}/robot-{site}.log") as log:
            late_s = max(late_s, float(re.search(r"late ([0-9.]+)", log.read()).group(1)))
    fleet.drain(SITES, DRAIN_S)
    behind_s = time.monotonic() - begin - SECONDS
    fleet.end_all()
    sent, lost, twice = fleet.compare(SITES)
    lost += ROBOTS * SECONDS - sent
    each_ms = {part: 1000.0 * spent / max(1, sent) for part, spent in fleet.spent_s.items()}
    print(f"{sent} | {lost} | {twice} | {late_s:.1f} | {behind_s:.1f} | {each_ms['robot']:.1f} "
          f"| {each_ms['site']:.1f} | {each_ms['server']:.1f} | {each_ms['centre']:.1f}")
    return 1 if lost or twice else 0


sys.exit(main())
