#!/usr/bin/env python3
"""Errors of a localised run: localisation_error.py ANSWERS MAP_TUM MAP_DATASET RUN_TUM RUN_DATASET

ANSWERS: of `unimapper localise --json`; RUN_TUM: of its --out; MAP_TUM: the mapped session's
trajectory in the map. Prints keyframes, localised ones, metres to the first (- without one) since
the robot came within 10 m of the way that was mapped, and of the errors (metres; how far each is from where it belongs, seen from the nearest pose of the map)
the root mean square, the 95th percentile, the worst, and the share beyond three claimed sigmas.
"""
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from overlap_error import estimated, seen_from, true


NEAR_M = 10.0


def places(dataset):
    rows = [list(map(float, line.split())) for line in open(dataset + "/gt_poses.txt")]
    return [(v[3], v[7], v[11]) for v in rows]


def before_map_m(map_data, run_data):
    """Path before the robot is beside the mapped way; all of it where it never is."""
    mapped, path = places(map_data), 0.0
    way = places(run_data)
    for last, at in zip(way, way[1:]):
        if min(math.dist(last, place) for place in mapped) < NEAR_M:
            break
        path += math.dist(last, at)
    return path


def main():
    answers, map_tum, map_data, run_tum, run_data = sys.argv[1:]
    said = json.load(open(answers))
    localised = [k for k in said["keyframes"] if k["state"] == "localised"]
    first = said["first_localised_m"]
    if first is not None:
        first = round(max(0.0, first - before_map_m(map_data, run_data)), 1)
    head = f"{len(said['keyframes'])} {len(localised)} {'-' if first is None else first}"
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
