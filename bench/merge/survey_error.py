#!/usr/bin/env python3
"""Error of a session in a survey: survey_error.py MAP SURVEY_TUM SURVEY_DATASET NAME DATASET

SURVEY_TUM: trajectory of the session that the survey was made of, in the survey's frame. Prints
what became of session NAME, as summary.json has it, and if it is in the map the root mean square
and the worst of how far its keyframes are from where they belong, in metres, seen from the nearest
pose of that trajectory.
"""
import json
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from overlap_error import estimated, seen_from, true


def main():
    folder, survey_tum, survey_data, name, data = sys.argv[1:]
    sessions = json.load(open(f"{folder}/summary.json"))["sessions"]
    status = next(s["status"] for s in sessions if s["name"] == name)
    if status != "merged":
        print(f"{status} | - | -")
        return
    surveyed, run = estimated(survey_tum), estimated(f"{folder}/trajectories/{name}.tum")
    survey_truth, run_truth = true(survey_data, list(surveyed)), true(data, list(run))
    surveyed = list(surveyed.values())
    errors = []
    for at, truth in zip(run.values(), run_truth):
        near = min(range(len(surveyed)), key=lambda i: math.dist(survey_truth[i][1], truth[1]))
        errors.append(math.dist(seen_from(surveyed[near], at[1]),
                                seen_from(survey_truth[near], truth[1])))
    rms = math.sqrt(sum(e * e for e in errors) / len(errors))
    print(f"{status} | {rms:.2f} | {max(errors):.2f}")


if __name__ == "__main__":
    main()
