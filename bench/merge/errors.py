#!/usr/bin/env python3
"""Errors of keyframes: how far each is from where it belongs, seen from the nearest pose of others

  errors.py overlap MAP SESSION=DATASET TWICE
      prints what became of the session that is not central, as summary.json has it, and if it is merged
      the root mean square over its keyframes within 15 m of the other session's, m; "none": there are none
  errors.py survey MAP SURVEY_TUM SURVEY_DATASET SESSION DATASET
      cells: what became of the session; root mean square and worst, m. SURVEY_TUM: trajectory, in the
      survey's frame, of the drive that the survey was made of
  errors.py localised ANSWERS MAP_TUM MAP_DATASET RUN_TUM RUN_DATASET
      prints keyframes, localised ones, metres to the first of them since the robot came within 10 m of the
      mapped way, root mean square, 95th percentile and worst, m, and the share beyond three claimed
      sigmas. ANSWERS and RUN_TUM: of `unimapper localise`; MAP_TUM: trajectory of the mapped session
"""
import json
import math
import sys

OVERLAP_M = 15.0
BESIDE_M = 10.0


def rotation(x, y, z, w):
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def rows(path):
    """Numbers of each line."""
    with open(path, encoding="utf-8") as lines:
        return [[float(word) for word in line.split()] for line in lines
                if line.strip() and not line.startswith("#")]


def true_way(dataset):
    """Poses as (rotation, translation), by scan."""
    return [((v[0:3], v[4:7], v[8:11]), (v[3], v[7], v[11])) for v in rows(dataset + "/gt_poses.txt")]


def trajectory(tum, dataset):
    """Estimated and true pose of each keyframe, the true one that of the nearest scan."""
    times = [row[0] for row in rows(dataset + "/times.txt")]
    truth = true_way(dataset)
    poses = []
    for stamp, tx, ty, tz, *quaternion in rows(tum):
        i = min(range(len(times)), key=lambda k: abs(times[k] - stamp))
        if abs(times[i] - stamp) > 0.01:
            sys.exit(f"error: {dataset} has no scan at {stamp}")
        poses.append(((rotation(*quaternion), (tx, ty, tz)), truth[i]))
    return poses


def seen_from(pose, point):
    d = [point[i] - pose[1][i] for i in range(3)]
    return [sum(pose[0][k][i] * d[k] for k in range(3)) for i in range(3)]


def errors_of(run, mapped, within_m=math.inf):
    """Of the keyframes of `run` that truly lie so near to one of `mapped`."""
    errors = []
    for found, truth in run:
        near_found, near_truth = min(mapped, key=lambda poses: math.dist(poses[1][1], truth[1]))
        if math.dist(near_truth[1], truth[1]) <= within_m:
            errors.append(math.dist(seen_from(near_truth, truth[1]), seen_from(near_found, found[1])))
    return errors


def rms(errors):
    return math.sqrt(sum(error * error for error in errors) / len(errors))


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def overlap(folder, *arguments):
    sessions = [argument.split("=", 1) for argument in arguments]
    status = next(session["status"] for session in read_json(folder + "/summary.json")["sessions"]
                  if session["status"] != "central")
    if status != "merged":
        return status
    mapped, run = (trajectory(f"{folder}/trajectories/{name}.tum", data) for name, data in sessions)
    errors = errors_of(run, mapped, OVERLAP_M)
    return f"{status} {rms(errors):.3f}" if errors else f"{status} none"


def survey(folder, survey_tum, survey_data, name, data):
    status = next(session["status"] for session in read_json(folder + "/summary.json")["sessions"]
                  if session["name"] == name)
    if status != "merged":
        return f"{status} | - | -"
    errors = errors_of(trajectory(f"{folder}/trajectories/{name}.tum", data),
                       trajectory(survey_tum, survey_data))
    return f"{status} | {rms(errors):.2f} | {max(errors):.2f}"


def before_map_m(map_data, run_data):
    """Path before the robot is beside the mapped way; all of it where it never is."""
    mapped = [place for _, place in true_way(map_data)]
    way = [place for _, place in true_way(run_data)]
    path_m = 0.0
    for last, at in zip(way, way[1:]):
        if min(math.dist(last, place) for place in mapped) < BESIDE_M:
            break
        path_m += math.dist(last, at)
    return path_m


def localised(answers, map_tum, map_data, run_tum, run_data):
    said = read_json(answers)
    keyframes = [keyframe for keyframe in said["keyframes"] if keyframe["state"] == "localised"]
    first = "-"
    if said["first_localised_m"] is not None:
        first = round(max(0.0, said["first_localised_m"] - before_map_m(map_data, run_data)), 1)
    head = f"{len(said['keyframes'])} {len(keyframes)} {first}"
    if not keyframes:
        return head + " - - - -"
    errors = errors_of(trajectory(run_tum, run_data), trajectory(map_tum, map_data))
    beyond = sum(error > 3 * of["sigma_m"] for error, of in zip(errors, keyframes))
    p95 = sorted(errors)[min(len(errors) - 1, int(0.95 * len(errors)))]
    return f"{head} {rms(errors):.2f} {p95:.2f} {max(errors):.2f} {beyond / len(errors):.2f}"


if __name__ == "__main__":
    print({"overlap": overlap, "survey": survey, "localised": localised}[sys.argv[1]](*sys.argv[2:]))
