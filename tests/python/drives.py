"""Simulated drives and runs of the tool that the tests share."""
import atexit
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import unimapper

TOOL = os.environ["UNIMAPPER_BINARY"]
_folder = tempfile.TemporaryDirectory()
atexit.register(_folder.cleanup)


def folder():
    """Where the tests put what they make; gone with the process."""
    return Path(_folder.name)


def tool(*words):
    """What the tool prints."""
    done = subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return done.stdout


def drive(route="A", scans=100):
    """The folder of a drive of ten seconds across a campus; those of two routes can be merged."""
    path = folder() / f"drive_{route}"
    if path.exists():
        return path
    tool("simulate", "--scene", "campus", "--sensor", "vlp-16", "--scans", scans, "--thin", 4,
         "--route", route, "--out", path)
    return path


def run(route="A"):
    """The run folder that the tool makes of a drive."""
    path = folder() / f"run_{route}"
    if not path.exists():
        tool("onboard", drive(route), "--out", path, "--final-labels")
    return path


def config():
    """The parameters of that run."""
    parameters = unimapper.preset("vlp-16")
    parameters.read_json(tool("onboard", drive(), "--dump-config"))
    return parameters


def street(x=0.0, points=4000):
    """Ground and a wall, seen from `x` along the street."""
    side = np.arange(points) % 80 - 40.0
    row = np.arange(points) // 80
    ground = np.column_stack([side - x, 0.2 * row - 5.0, np.full(points, -1.5)])
    wall = np.column_stack([side - x, np.full(points, 6.0), 0.1 * row - 1.5])
    return np.concatenate([ground, wall]).astype(np.float32)


def pose(x=0.0):
    """A level pose at `x` metres."""
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix
