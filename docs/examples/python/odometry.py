"""Odometry from scans alone: its path is red, over the true or the recorded one in grey.

usage: odometry.py DRIVE PICTURE
"""
import sys

import numpy as np
import unimapper
from picture import TopView

drive, picture = sys.argv[1:]
dataset = unimapper.open_dataset(drive, deskew="off")  # the odometry compensates sweeps itself
odometry = unimapper.LidarOdometry()
stamps, poses, recorded = [], [], []
for scan in dataset:
    result = odometry.add_scan(scan.stamp_ns, scan.points, scan.time_s)
    if not result.ok or result.state in (unimapper.OdometryState.DEGENERATE,
                                         unimapper.OdometryState.LOST):
        print(scan.name, result.message or result.reason)
    stamps.append(scan.stamp_ns)
    poses.append(result.T_odometry_sensor)
    recorded.append(scan.T_odometry_sensor)
path = np.array(poses)[:, :3, 3]

stamps, truth = np.array(stamps), dataset.ground_truth_poses()
truth = truth if len(truth) > 0 else np.array(recorded)
error = unimapper.trajectory_error(stamps, poses, stamps, truth)
print(f"ATE {error['translation_m']['rmse']:.3f} m, {error['rotation_deg']['rmse']:.3f} degrees")
true_path = (np.linalg.inv(error["T_truth_estimate"]) @ truth)[:, :3, 3]
pixel_m = max(0.05, np.ptp(path, axis=0).max() / 1000)
view = TopView(np.concatenate([path, true_path]), pixel_m, margin_m=40 * pixel_m)
view.draw(true_path, (150, 150, 150), 5)
view.draw(path, (220, 40, 40), 2)
view.write(picture)
