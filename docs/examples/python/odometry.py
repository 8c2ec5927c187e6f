"""Odometry from scans alone: its path is drawn red, over the true one in grey.

usage: odometry.py DRIVE PICTURE
"""
import sys

import numpy as np
import unimapper
from picture import TopView

drive, picture = sys.argv[1:]
dataset = unimapper.open_dataset(drive, deskew="off")  # the odometry compensates sweeps itself
odometry = unimapper.LidarOdometry()
stamps, poses = [], []
for scan in dataset:
    result = odometry.add_scan(scan.stamp_ns, scan.points, scan.time_s)
    if not result.ok or result.state in (unimapper.OdometryState.DEGENERATE,
                                         unimapper.OdometryState.LOST):
        print(scan.name, result.message or result.reason)
    stamps.append(scan.stamp_ns)
    poses.append(result.T_odometry_sensor)
path = np.array(poses)[:, :3, 3]

truth = dataset.ground_truth_poses()
view = TopView(path, pixel_m=0.05, margin_m=2.0)
if len(truth) > 0:
    stamps = np.array(stamps)
    error = unimapper.trajectory_error(stamps, poses, stamps, truth)
    print(f"ATE {error['translation_m']['rmse']:.3f} m, {error['rotation_deg']['rmse']:.3f} degrees")
    T_estimate_truth = np.linalg.inv(error["T_truth_estimate"])
    view.draw((T_estimate_truth @ truth)[:, :3, 3], (150, 150, 150), 5)
view.draw(path, (220, 40, 40), 2)
view.write(picture)
