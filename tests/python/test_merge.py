"""Tests of places, sessions, merging and stored maps in Python."""
import functools
import gc
import json
import unittest

import drives
import numpy as np
import unimapper

STORE = drives.folder() / "store"


@functools.cache
def tool_map():
    """The map folder that the tool makes of two runs, by way of a store."""
    folder = drives.folder() / "map"
    drives.tool("map", "create", "--store", STORE)
    drives.tool("map", "add", "--store", STORE, drives.run("A"), drives.run("B"))
    drives.tool("map", "merge", "--store", STORE)
    drives.tool("map", "export", "--store", STORE, "--out", folder)
    return folder


@functools.cache
def merged():
    """The same map, merged here."""
    return unimapper.merge_sessions(unimapper.read_sessions([drives.run("B"), drives.run("A")]))


def mapped_here(route, boot):
    """A session of the pipeline in Python."""
    session = unimapper.Session(f"run_{route}", "vlp-16", boot=boot)
    pipeline = unimapper.Pipeline(drives.config())
    for scan in unimapper.open_dataset(drives.drive(route)):
        result = pipeline.add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns)
        if result.keyframe_finished:
            session.add_keyframe(pipeline.encode(boot=boot))
    return session


class Merging(unittest.TestCase):
    """Maps are those of the tool, bit by bit."""

    def test_a_map_and_its_files_are_those_of_the_tool(self):
        result = merged()
        self.assertEqual([s["name"] for s in result.sessions()], ["run_A", "run_B"])
        self.assertEqual({s["status"] for s in result.sessions()}, {"central", "merged"})
        folder = drives.folder() / "map_here"
        result.export(folder)
        for file in ("map.ply", "loops.csv", "graph.g2o", "removed.ply", "changes.ply",
                     "trajectories/run_A.tum", "trajectories/run_B.tum"):
            self.assertEqual((folder / file).read_bytes(), (tool_map() / file).read_bytes(), file)
        self.assertEqual(len(result.points()), len(result.point_sessions()))
        self.assertEqual(set(result.sessions_seen()), {1, 2})
        self.assertGreater(result.intensities().max(), 100)
        self.assertTrue(any(loop["accepted"] for loop in result.loops()))
        self.assertEqual(result.dynamic_points().shape[1], 3)

    def test_errors_of_trajectories_are_those_the_tool_tells(self):
        truth = {r: unimapper.open_dataset(drives.drive(r)) for r in "AB"}
        told = json.loads(drives.tool("evaluate", "trajectory", "--map", tool_map(), "--truth",
                                      *(f"run_{r}={drives.drive(r)}" for r in "AB")))["sessions"]
        alignment = None
        central = merged().central_session
        for session in (central, 1 - central):
            route = "AB"[session]
            stamps = np.array([truth[route].stamp_ns(i) for i in range(100)])
            poses = truth[route].ground_truth_poses()
            file = tool_map() / "trajectories" / f"run_{route}.tum"
            read = unimapper.trajectory_error(*unimapper.read_trajectory(file), stamps, poses,
                                              alignment)
            here = unimapper.trajectory_error(*merged().trajectory(session), stamps, poses,
                                              alignment)
            alignment = read["T_truth_estimate"] if alignment is None else alignment
            self.assertEqual(read["translation_m"]["rmse"], told[f"run_{route}"]["ate_m"]["rmse"])
            self.assertAlmostEqual(here["translation_m"]["rmse"], read["translation_m"]["rmse"], 9)

    def test_sessions_of_the_pipeline_here_are_those_of_the_tool(self):
        here = mapped_here("A", 1)
        read = unimapper.read_sessions([drives.run("A")])[0]
        self.assertEqual((here.name, here.sensor, len(here)), (read.name, read.sensor, len(read)))
        np.testing.assert_array_equal(here.T_odometry_keyframe, read.T_odometry_keyframe)
        for k in range(len(read)):
            np.testing.assert_array_equal(here.static_cells(k), read.static_cells(k))
            np.testing.assert_array_equal(here.dynamic_cells(k), read.dynamic_cells(k))
        alone = unimapper.merge_sessions([here])
        self.assertEqual(alone.sessions()[0]["status"], "central")

    def test_a_stored_map_is_the_one_that_was_merged(self):
        tool_map()
        stored = unimapper.read_map(STORE)
        np.testing.assert_array_equal(stored.points(), merged().points())
        self.assertEqual(len(unimapper.read_sessions([STORE], sessions=["run_B"])), 1)
        with self.assertRaisesRegex(RuntimeError, "run_A, run_B"):
            unimapper.read_sessions([STORE], sessions=["run_C"])
        with self.assertRaisesRegex(RuntimeError, "no map in epoch"):
            unimapper.read_map(STORE, epoch=1)
        with self.assertRaises(RuntimeError):
            unimapper.read_map(STORE, epoch=99)
        with self.assertRaises(ValueError):
            unimapper.read_map(STORE, epoch=-1)

    def test_a_map_is_in_the_coordinate_system_of_its_store(self):
        store, folder = drives.folder() / "site", drives.folder() / "placed"
        drives.tool("map", "create", "--store", store)
        drives.tool("map", "add", "--store", store, drives.run("A"))
        unimapper.state_crs(store, "EPSG:25832")
        for keyframe, x in ((0, 0), (9, 9)):
            drives.tool("map", "position", "--store", store, f"run_A:{keyframe}", "--at",
                        691000 + x, 5335000, 500, "--sigma", 1)
        drives.tool("map", "merge", "--store", store)
        drives.tool("map", "export", "--store", store, "--las", "--out", folder)
        stored = unimapper.read_map(store)
        stored.export(drives.folder() / "placed_here", las=True)
        for file in ("map.las", "georeference.json", "summary.json"):
            self.assertEqual((drives.folder() / "placed_here" / file).read_bytes(),
                             (folder / file).read_bytes(), file)
        self.assertEqual(stored.crs, "EPSG:25832")
        np.testing.assert_array_equal(stored.origin, [691000, 5335000, 0])
        self.assertIn(b"EPSG:25832", (folder / "summary.json").read_bytes())
        with self.assertRaisesRegex(RuntimeError, "EPSG:4326.*no projected system"):
            unimapper.state_crs(store, "EPSG:4326")
        self.assertEqual((merged().crs, merged().origin), ("", None))
        with self.assertRaisesRegex(RuntimeError, "no known position"):
            merged().export(drives.folder() / "unplaced", crs="EPSG:25832")

    def test_what_a_callback_raises_ends_the_merge(self):
        said = []

        def progress(text):
            said.append(text)
            raise KeyError("enough")

        with self.assertRaisesRegex(KeyError, "enough"):
            unimapper.merge_sessions(unimapper.read_sessions([drives.run("A")]), progress=progress)
        self.assertEqual(len(said), 1)

    def test_wrong_sessions_are_refused(self):
        with self.assertRaisesRegex(RuntimeError, "nowhere"):
            unimapper.read_sessions(["/nowhere"])
        for sessions in (None, [None], ["run"], 5):
            with self.assertRaises(TypeError):
                unimapper.merge_sessions(sessions)
        session = unimapper.Session("a")
        for encoded in (b"", b"keyframe", bytes(1000)):
            with self.assertRaises(ValueError):
                session.add_keyframe(encoded)
        with self.assertRaises(TypeError):
            session.add_keyframe(None)
        pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))
        pipeline.add_scan(drives.street(), drives.pose(), 0)
        pipeline.flush()
        with self.assertRaisesRegex(ValueError, "another session"):
            session.add_keyframe(pipeline.encode(boot=7))
        session.add_keyframe(pipeline.encode())
        with self.assertRaisesRegex(ValueError, "ascending"):
            session.add_keyframe(pipeline.encode())
        with self.assertRaises(IndexError):
            session.static_cells(1)
        with self.assertRaisesRegex(ValueError, "fixed"):
            unimapper.read_sessions([drives.run("A")])[0].add_keyframe(pipeline.encode())
        config = unimapper.MergeConfig()
        with self.assertRaises(ValueError):
            config["threads"] = -1
        with self.assertRaises(IndexError):
            merged().trajectory(2)


class Places(unittest.TestCase):
    """Places are described and recognised."""

    def test_a_place_is_recognised_from_another_heading(self):
        describer = unimapper.PlaceDescriber()
        database = unimapper.PlaceDatabase()
        session = unimapper.read_sessions([drives.run("A")])[0]
        cells = session.static_cells(0)
        database.insert(describer.describe(cells), (1, 0), np.eye(4))
        self.assertEqual(len(database), 1)
        turned = np.column_stack([-cells[:, 1], cells[:, 0], cells[:, 2]])
        place = describer.describe(turned)
        found = database.search(place, (2, 0))
        self.assertEqual(found[0].match, (1, 0))
        self.assertTrue(found[0].accepted)
        self.assertAlmostEqual(found[0].T_match_query[0, 1], 1.0, places=2)
        self.assertEqual(database.search(place, (2, 0), sessions="only_same"), [])
        keypoints = place.keypoints
        del place, describer, database
        gc.collect()
        self.assertEqual(keypoints.shape[1], 3)
        self.assertTrue(np.isfinite(keypoints).all())

    def test_the_pipeline_finds_places_of_an_earlier_run(self):
        place = unimapper.PlaceDescriber().describe(
            unimapper.read_sessions([drives.run("A")])[0].static_cells(0))
        pipeline = unimapper.Pipeline(drives.config())
        pipeline.insert_place(place, 1, 0, np.eye(4))
        with self.assertRaises(ValueError):
            pipeline.insert_place(place, 0, 0, np.eye(4))
        dataset = unimapper.open_dataset(drives.drive())
        found = []
        for i in range(10):
            scan = dataset[i]
            if pipeline.add_scan(scan.points, scan.T_odometry_sensor,
                                 scan.stamp_ns).keyframe_finished:
                found = pipeline.finished_keyframe().loops
        self.assertEqual(found[0].match, (1, 0))

    def test_wrong_cells_are_refused(self):
        describer = unimapper.PlaceDescriber(max_cells=100)
        self.assertEqual(len(describer.describe(np.zeros((0, 3), np.float32)).keypoints), 0)
        describer.describe(drives.street())
        for value in (np.nan, np.inf, 1e30):
            with self.assertRaisesRegex(ValueError, "cells"):
                describer.describe(np.full((5, 3), value, np.float32))
        with self.assertRaises(TypeError):
            describer.describe(None)
        with self.assertRaises(ValueError):
            unimapper.PlaceDatabase().insert(unimapper.PlaceDescriber().describe(drives.street()),
                                             (1, 0), np.full((4, 4), np.nan))
        config = unimapper.DescriptorConfig()
        with self.assertRaises(ValueError):
            config["max_keypoints"] = 4  # fewer than any place needs
            unimapper.PlaceDescriber(config)
        with self.assertRaises((TypeError, ValueError)):
            unimapper.PlaceDescriber(max_cells=-1)


if __name__ == "__main__":
    unittest.main()
