"""Mapping of a drive: what is static is drawn grey, what moves red.

usage: map_a_drive.py DRIVE SENSOR PICTURE
"""
import sys

import numpy as np
import unimapper
from picture import TopView

drive, sensor, picture = sys.argv[1:]
dataset = unimapper.open_dataset(drive)
pipeline = unimapper.Pipeline(unimapper.preset(sensor))
static, dynamic, path = [], [], []


def collect(result):
    """Takes the cells of a keyframe that is ready into the odometry's frame."""
    if not result.keyframe_ready:
        return
    keyframe = pipeline.keyframe()
    T_odometry_keyframe = keyframe.T_odometry_keyframe
    for cells, kept in ((keyframe.static_cells[keyframe.ground == 0], static),
                        (keyframe.dynamic_cells, dynamic)):
        kept.append(cells @ T_odometry_keyframe[:3, :3].T + T_odometry_keyframe[:3, 3])


for scan in dataset:
    result = pipeline.add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns)
    if not result.ok:
        print(scan.name, result.message)
    path.append(scan.T_odometry_sensor[:3, 3])
    collect(result)
collect(pipeline.flush())

static, dynamic = np.concatenate(static), np.concatenate(dynamic)
print(f"{len(static)} static cells above the ground, {len(dynamic)} dynamic ones")
view = TopView(static)
view.draw(static, (150, 150, 150))
view.draw(dynamic, (220, 40, 40))
view.draw(path, (30, 90, 200), 2)
view.write(picture)
