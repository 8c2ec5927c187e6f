#!/usr/bin/env python3
"""Cells of a row of run.sh: what a year of one site takes.

  year.py RUN...   runs of one LiDAR at 10 scans a second
"""
import json
import sys

ROBOTS, HOURS_A_DAY, DAYS_A_YEAR, OUTAGE_DAYS = 20, 8, 250, 3
EUROS_A_TERABYTE = 20
SCANS_A_SECOND = 10

keyframes = seconds = total = 0
for run in sys.argv[1:]:
    with open(f"{run}/stats.json") as file:
        stats = json.load(file)
    keyframes += stats["keyframes"]
    seconds += stats["scans"] / SCANS_A_SECOND
    total += stats["keyframes"] * stats["message_bytes_per_keyframe"]["all"]
an_hour = 3600 * keyframes / seconds
site_gigabytes_a_day = ROBOTS * HOURS_A_DAY * an_hour * total / keyframes / 1e9
a_year = site_gigabytes_a_day * DAYS_A_YEAR / 1000
mbit_s = site_gigabytes_a_day * 8000 / (HOURS_A_DAY * 3600)
print(f"{total / keyframes / 1000:.0f} | {an_hour:.0f} | {site_gigabytes_a_day:.0f} | {mbit_s:.1f} "
      f"| {site_gigabytes_a_day * OUTAGE_DAYS:.0f} | {a_year:.1f} | {2 * a_year * EUROS_A_TERABYTE:.0f}")
