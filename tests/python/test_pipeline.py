"""Tests of the pipeline in Python."""
import copy
import gc
import threading
import unittest

import drives
import numpy as np
import unimapper


def feed(pipeline, scans, start=0):
    """Drives along the street; calls that closed a keyframe."""
    closed = []
    for i in range(start, start + scans):
        result = pipeline.add_scan(drives.street(0.1 * i), drives.pose(0.1 * i), i * 100_000_000)
        if result.keyframe_ready:
            closed.append(i)
    return closed


class Labels(unittest.TestCase):
    """Labels are those of the tool, bit by bit."""

    def test_labels_of_a_drive_are_those_the_tool_writes(self):
        dataset = unimapper.open_dataset(drives.drive())
        pipeline = unimapper.Pipeline(drives.config())
        scans, open_scans, online, final = [], {}, {}, {}

        def collect(result):
            if result.keyframe_ready:
                keyframe = pipeline.keyframe()
                open_scans[keyframe.sequence] = list(keyframe.scan_indices)
                for i, scan in enumerate(keyframe.scan_indices):
                    online[scan] = pipeline.labels(i)
                    final[scan] = online[scan].copy()
            if result.keyframe_finished:
                relabel(pipeline.relabelled())

        def relabel(sequence):
            for scan in open_scans.get(sequence, []):
                read = scans[scan]
                pipeline.relabel(read.points, read.T_odometry_sensor, final[scan])

        for i in range(len(dataset)):
            scan = dataset[i]
            scans.append(scan)
            collect(pipeline.add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns))
        collect(pipeline.flush())
        while (sequence := pipeline.relabel_next()) is not None:
            relabel(sequence)

        self.assertEqual(len(online), 100)
        dynamic = 0
        for folder, labels in (("labels", online), ("final/labels", final)):
            for i, scan in enumerate(scans):
                written = np.fromfile(drives.run() / folder / f"{scan.name}.label", np.uint32)
                self.assertEqual(len(written), len(labels[i]))
                moving = labels[i] == unimapper.DYNAMIC
                np.testing.assert_array_equal(written == 251, moving)
                dynamic += int(moving.sum())
        self.assertGreater(dynamic, 1000)
        self.assertTrue(any((online[i] != final[i]).any() for i in online))

    def test_strides_and_columns_change_no_label(self):
        points = drives.street()
        wide = np.zeros((len(points), 4), np.float32)
        wide[:, :3] = points
        columns = np.asfortranarray(points)
        backwards = np.ascontiguousarray(points[::-1])[::-1]
        seen = []
        for scan in (points, wide, columns, backwards, wide[:, :3]):
            pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))
            pipeline.add_scan(scan, drives.pose(), 0)
            self.assertTrue(pipeline.flush().keyframe_ready)
            seen.append(pipeline.labels(0))
        for labels in seen[1:]:
            np.testing.assert_array_equal(seen[0], labels)

    def test_points_without_a_position_are_unknown_and_those_beyond_the_capacity_static(self):
        config = unimapper.preset("vlp-16")
        config["keyframe.max_points_per_scan"] = 4000
        pipeline = unimapper.Pipeline(config)
        points = drives.street()
        points[7] = np.nan
        pipeline.add_scan(points, drives.pose(), 0)
        pipeline.flush()
        labels = pipeline.labels(0)
        self.assertEqual(labels.dtype, np.uint8)
        self.assertEqual(len(labels), len(points))
        self.assertEqual(labels[7], unimapper.UNKNOWN)
        self.assertTrue((labels[4000:] == unimapper.STATIC).all())

    def test_labels_are_written_into_an_array_of_the_caller(self):
        pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))
        pipeline.add_scan(drives.street(), drives.pose(), 0)
        pipeline.flush()
        out = np.zeros(8000, np.uint8)
        self.assertIs(pipeline.labels(-1, out=out), out)
        np.testing.assert_array_equal(out, pipeline.labels(0))
        with self.assertRaisesRegex(ValueError, "8000 points, not 7999"):
            pipeline.labels(0, out=out[1:])
        with self.assertRaises(ValueError):
            pipeline.labels(0, out=np.zeros(16000, np.uint8)[::2])
        out.flags.writeable = False
        with self.assertRaises((ValueError, RuntimeError)):
            pipeline.labels(0, out=out)


class Refusals(unittest.TestCase):
    """Wrong arguments are exceptions, wrong scans are results."""

    def setUp(self):
        self.pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))

    def add(self, points, pose=None, stamp_ns=0):
        return self.pipeline.add_scan(points, np.eye(4) if pose is None else pose, stamp_ns)

    def test_wrong_points_are_refused(self):
        for points in (None, [[1, 2, 3]], "points", np.zeros((5, 3)), np.zeros((5, 3), np.int32),
                       np.zeros((5, 3), ">f4")):
            with self.assertRaisesRegex(TypeError, "points: .*float32"):
                self.add(points)
        for shape in ((5,), (5, 2), (5, 5), (1, 5, 3), ()):
            with self.assertRaisesRegex(ValueError, "points: the shape is"):
                self.add(np.zeros(shape, np.float32))

    def test_wrong_poses_and_stamps_are_refused(self):
        points = drives.street()
        for pose in (np.eye(3), np.zeros(16), np.ones((4, 4))):
            with self.assertRaises(ValueError):
                self.add(points, pose)
        for pose in ("pose", [["a"]]):
            with self.assertRaises(TypeError):
                self.add(points, pose)
        with self.assertRaises(TypeError):
            self.pipeline.add_scan(points, None, 0)
        for stamp in (0.5, None, 2**70):
            with self.assertRaises(TypeError):
                self.add(points, stamp_ns=stamp)

    def test_a_scan_that_cannot_be_used_says_why(self):
        empty = self.add(np.zeros((0, 3), np.float32))
        self.assertFalse(empty.ok)
        self.assertEqual(empty.error, unimapper.ErrorCode.EMPTY_SCAN)
        self.assertNotEqual(empty.message, "")
        not_rigid = drives.pose()
        not_rigid[0, 0] = np.nan
        self.assertEqual(self.add(drives.street(), not_rigid).error,
                         unimapper.ErrorCode.INVALID_POSE)
        self.assertTrue(self.add(drives.street(), stamp_ns=5).ok)
        self.assertEqual(self.add(drives.street(), stamp_ns=5).error,
                         unimapper.ErrorCode.TIME_REVERSED)

    def test_what_is_not_there_is_a_runtime_error(self):
        for ask in (self.pipeline.keyframe, self.pipeline.finished_keyframe, self.pipeline.encode,
                    lambda: self.pipeline.labels(0),
                    lambda: self.pipeline.relabel(drives.street(), np.eye(4),
                                                  np.zeros(8000, np.uint8))):
            with self.assertRaises(RuntimeError):
                ask()
        self.assertIsNone(self.pipeline.relabelled())
        self.assertIsNone(self.pipeline.relabel_next())
        self.add(drives.street())
        self.pipeline.flush()
        for scan in (1, -2, 2**40):
            with self.assertRaises(IndexError):
                self.pipeline.labels(scan)

    def test_wrong_configurations_are_refused(self):
        config = unimapper.preset("Ouster OS2-128")
        with self.assertRaisesRegex(KeyError, "did you mean removal.window"):
            config["removal.windw"] = 5
        for value in (0, 33, -1, 2.5, "five", float("nan")):
            with self.assertRaises(ValueError):
                config["removal.window"] = value
        with self.assertRaises(TypeError):
            config["removal.window"] = None
        config["removal.window"] = np.int64(5)
        config["keyframe.range_max_m"] = np.float32(80)
        config["deferred"] = True
        self.assertEqual((config["removal.window"], config["keyframe.range_max_m"],
                          config["deferred"]), (5, 80.0, True))
        again = unimapper.PipelineConfig()
        again.read_json(config.to_json())
        self.assertEqual(dict(again), dict(config))
        self.assertEqual(dict(copy.deepcopy(again)), dict(config))
        with self.assertRaises(ValueError):
            again.read_json('{"removal": {"window": 99}}')
        self.assertEqual(again["removal.window"], 5)
        config["keyframe.range_min_m"] = 100
        with self.assertRaises(ValueError):
            unimapper.Pipeline(config)
        with self.assertRaisesRegex(ValueError, "vlp-16"):
            unimapper.preset("no such LiDAR")
        with self.assertRaises(TypeError):
            unimapper.Pipeline(None)


class Keyframes(unittest.TestCase):
    """Keyframes stay as they are, whatever becomes of the pipeline."""

    def test_a_keyframe_and_its_arrays_outlive_the_pipeline(self):
        pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))
        self.assertEqual(feed(pipeline, 10), [9])
        keyframe = pipeline.keyframe()
        cells = keyframe.static_cells
        before = cells.copy()
        feed(pipeline, 10, start=10)
        del pipeline, keyframe
        gc.collect()
        np.testing.assert_array_equal(cells, before)
        self.assertEqual((cells.shape[1], cells.dtype), (3, np.float32))
        self.assertGreater(len(cells), 100)
        with self.assertRaises(ValueError):
            cells[0, 0] = 1.0

    def test_a_keyframe_says_of_which_scans_it_is(self):
        pipeline = unimapper.Pipeline(unimapper.preset("vlp-16"))
        feed(pipeline, 10)
        keyframe = pipeline.keyframe()
        self.assertEqual(list(keyframe.scan_indices), list(range(10)))
        self.assertEqual(list(keyframe.stamps_ns), [i * 100_000_000 for i in range(10)])
        self.assertAlmostEqual(keyframe.T_odometry_sensor[9, 0, 3], 0.9)
        self.assertEqual(keyframe.statistics["points_in"], 80000)
        self.assertEqual(len(keyframe.ground), len(keyframe.static_cells))
        self.assertGreater(len(pipeline.encode()), 1000)

    def test_cells_have_the_intensities_of_their_points(self):
        config = unimapper.preset("vlp-16")
        config["intensity"] = True
        config["keyframe.scans"] = 1
        config["free_space.images_per_keyframe"] = 1
        pipeline = unimapper.Pipeline(config)
        points = drives.street()
        intensities = np.where(points[:, 2] == -1.5, 10, 200).astype(np.uint8)
        self.assertTrue(pipeline.add_scan(points, np.eye(4), 0, intensities).keyframe_ready)
        keyframe = pipeline.keyframe()
        self.assertEqual(len(keyframe.intensities), len(keyframe.static_cells))
        high = keyframe.static_cells[:, 2] > -1.0
        self.assertEqual(set(keyframe.intensities[high]), {200})
        with self.assertRaisesRegex(ValueError, "one for each point"):
            pipeline.add_scan(points, np.eye(4), 1, intensities[1:])

    def test_threads_may_share_a_pipeline(self):
        config = unimapper.preset("vlp-16")
        pipeline = unimapper.Pipeline(config)
        results, stop = [], threading.Event()

        def ask():
            while not stop.is_set():
                try:
                    pipeline.labels(0)
                    pipeline.keyframe()
                except RuntimeError:
                    pass

        other = threading.Thread(target=ask)
        other.start()
        try:
            results = feed(pipeline, 30)
        finally:
            stop.set()
            other.join()
        self.assertEqual(results, [9, 19, 29])

    def test_deferred_work_gives_the_same_labels_in_calls_of_bounded_time(self):
        config = unimapper.preset("vlp-16")
        at_once = unimapper.Pipeline(config)
        feed(at_once, 10)
        config["deferred"] = True
        config["budget_us"] = 100_000
        deferred = unimapper.Pipeline(config)
        self.assertEqual(feed(deferred, 10), [])
        while not deferred.work().keyframe_ready:
            pass
        for i in range(10):
            np.testing.assert_array_equal(deferred.labels(i), at_once.labels(i))
        self.assertGreater(at_once.keyframe().statistics["total_us"], 0.0)


if __name__ == "__main__":
    unittest.main()
