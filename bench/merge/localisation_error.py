#!/usr/bin/env python3
"""Errors of a localised run: localisation_error.py ANSWERS MAP_TUM MAP_DATASET RUN_TUM RUN_DATASET

ANSWERS: of `unimapper localise --json`; RUN_TUM: of its --out; MAP_TUM: the mapped session's
trajectory in the map. Prints keyframes, localised ones, metres to the first (- without one), and of
the errors (metres; how far each is from where it belongs, seen from the nearest pose of the map)
the root mean square, the 95th percentile, the worst, and the share beyond three claimed sigmas.
"""
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from overlap_error import estimated, seen_from, true


def main():
    answers, map_tum, map_data, run_tum, run_data = sys.argv[1:]
    said = json.load(open(answers))
    localised = [k for k in said["keyframes"] if k["state"] == "localised"]
    first = said["first_localised_m"]
    head = f"{len(said['keyframes'])} {len(localised)} {'-' if first is None else round(first, 1)}"
    if not localised:
        print(head, "- - - -")
        return
    mapped, run = estimated(map_tum), estimated(run_tum)
    map_truth, run_truth = true(map_data, list(mapped)), true(run_data, list(run))
    mapped, run = list(mapped.values()), list(run.values())
    errors, beyond = [], 0
    for at, truth, said_of in zip(run, run_truth, localised):
        near = min(range(len(mapped)), key=lambda i: math.dist(map_truth[i][1], truth[1]))
        error = math.dist(seen_from(mapped[near], at[1]), seen_from(map_truth[near], truth[1]))
        errors.append(error)
        beyond += error > 3 * said_of["sigma_m"]
    errors.sort()
    rms = math.sqrt(sum(e * e for e in errors) / len(errors))
    p95 = errors[min(len(errors) - 1, int(0.95 * len(errors)))]
    print(head, f"{rms:.2f} {p95:.2f} {errors[-1]:.2f} {beyond / len(errors):.2f}")


if __name__ == "__main__":
    main()
