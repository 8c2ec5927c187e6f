"""Merging of two drives, from scans to one map: a colour for each session.

usage: merge_sessions.py SENSOR PICTURE DRIVE...
"""
import sys
from pathlib import Path

import unimapper
from picture import TopView

COLORS = [(230, 140, 30), (30, 110, 200), (40, 160, 70), (160, 60, 170)]


def map_drive(folder, sensor, boot):
    """A session of a drive; `boot` differs from start to start of a robot."""
    session = unimapper.Session(Path(folder).name, sensor, boot=boot)
    pipeline = unimapper.Pipeline(unimapper.preset(sensor))
    for scan in unimapper.open_dataset(folder):
        result = pipeline.add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns)
        if result.keyframe_finished:
            session.add_keyframe(pipeline.encode(boot=boot))
    if pipeline.flush().keyframe_finished:
        session.add_keyframe(pipeline.encode(boot=boot))
    return session


sensor, picture, *drives = sys.argv[1:]
sessions = [map_drive(drive, sensor, boot) for boot, drive in enumerate(drives)]
merged = unimapper.merge_sessions(sessions, progress=print)
for session in merged.sessions():
    print(session["name"], session["status"], session["reason"])

points, of_session = merged.points(), merged.point_sessions()
view = TopView(points)
for i in range(len(sessions)):
    view.draw(points[of_session == i], COLORS[i % len(COLORS)])
    view.draw(merged.trajectory(i)[1][:, :3, 3], (0, 0, 0), 2)
view.write(picture)
