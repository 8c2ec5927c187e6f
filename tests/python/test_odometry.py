"""Tests of odometry, recordings and trajectories in Python."""
import gc
import json
import threading
import unittest

import drives
import numpy as np
import unimapper


class Odometry(unittest.TestCase):
    """Poses are those of the tool, bit by bit."""

    def test_poses_of_a_drive_are_those_the_tool_writes(self):
        file = drives.folder() / "drive.tum"
        drives.tool("odometry", drives.drive(), "--out", file)
        stamps_ns, written = unimapper.read_trajectory(file)
        dataset = unimapper.open_dataset(drives.drive(), own_odometry=True)
        recorded = unimapper.open_dataset(drives.drive(), deskew="off")
        odometry = unimapper.LidarOdometry()
        self.assertEqual(len(dataset), len(written))
        for i in range(len(dataset)):
            scan = recorded[i]
            result = odometry.add_scan(scan.stamp_ns, scan.points, scan.time_s)
            self.assertTrue(result.ok, result.message)
            np.testing.assert_array_equal(result.T_odometry_sensor, dataset.pose(i))
            self.assertEqual(stamps_ns[i], scan.stamp_ns)
            # The file holds quaternions: the digits are all there, the matrix is computed anew.
            np.testing.assert_allclose(written[i], dataset.pose(i), rtol=0, atol=1e-14)
            np.testing.assert_array_equal(written[i][:3, 3], dataset.pose(i)[:3, 3])
        self.assertEqual(result.state, unimapper.OdometryState.TRACKING)
        self.assertEqual(result.covariance.shape, (6, 6))
        self.assertEqual(result.weak_axes.shape, (0, 6))
        self.assertEqual(odometry.statistics["scans"], 100)
        self.assertGreater(result.velocity_m_s[0], 0.5)

    def test_wrong_scans_are_refused(self):
        odometry = unimapper.LidarOdometry()
        points = drives.street()
        for times in (np.zeros(8000), [0.0] * 8000):
            with self.assertRaisesRegex(TypeError, "time_s"):
                odometry.add_scan(0, points, times)
        for times in (np.zeros(7999, np.float32), np.zeros((8000, 1), np.float32)):
            with self.assertRaisesRegex(ValueError, "time_s"):
                odometry.add_scan(0, points, times)
        self.assertEqual(odometry.add_scan(0, points[:5]).error, unimapper.ErrorCode.EMPTY_SCAN)
        self.assertFalse(odometry.add_scan(0, np.full((500, 3), np.nan, np.float32)).ok)
        config = unimapper.LidarOdometryConfig()
        config["min_range_m"] = 10
        config["max_range_m"] = 5
        with self.assertRaises(ValueError):
            unimapper.LidarOdometry(config)

    def test_an_imu_levels_the_first_scan(self):
        odometry = unimapper.LidarOdometry()
        for i in range(50):
            odometry.add_imu(i * 10_000_000, np.zeros(3), np.array([0.0, 6.0, 8.0]))
        with self.assertRaises(ValueError):
            odometry.add_imu(10**9, np.zeros(2))
        with self.assertRaises(ValueError):
            odometry.add_imu(0, np.zeros(3))
        result = odometry.add_scan(490_000_000, drives.street())
        np.testing.assert_allclose(result.T_odometry_sensor[2, :3], [0.0, 0.6, 0.8], atol=1e-12)
        self.assertEqual(result.up_sigma_rad, np.inf)

    def test_threads_may_share_an_odometry(self):
        odometry = unimapper.LidarOdometry()
        accepted = []

        def add(first):
            for i in range(first, first + 5):
                accepted.append(odometry.add_scan(i * 1000, drives.street()).ok)

        threads = [threading.Thread(target=add, args=(k * 5,)) for k in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(accepted), 15)
        self.assertEqual(odometry.statistics["scans"], sum(accepted))


class Recordings(unittest.TestCase):
    """Recordings are read as the tool reads them."""

    def test_a_scan_outlives_its_recording(self):
        dataset = unimapper.open_dataset(drives.drive())
        scan = dataset[-1]
        points = scan.points
        del dataset, scan
        gc.collect()
        self.assertEqual((points.shape[1], points.dtype), (4, np.float32))
        self.assertTrue(np.isfinite(points).all())
        with self.assertRaises(ValueError):
            points[0, 0] = 1.0

    def test_a_recording_is_a_sequence(self):
        dataset = unimapper.open_dataset(drives.drive())
        self.assertEqual(len(dataset), 100)
        self.assertEqual(sum(1 for _ in dataset), 100)
        with self.assertRaises(IndexError):
            dataset[100]
        with self.assertRaises(IndexError):
            dataset.pose(-101)
        with self.assertRaises(TypeError):
            dataset["first"]
        self.assertEqual(len(dataset.labels(3)), len(dataset[3]))
        self.assertEqual(dataset.ground_truth_poses().shape, (100, 4, 4))
        self.assertTrue(dataset.has_poses)

    def test_what_cannot_be_read_is_a_dataset_error_with_its_name(self):
        with self.assertRaisesRegex(unimapper.DatasetError, "nowhere"):
            unimapper.open_dataset("/nowhere")
        with self.assertRaisesRegex(unimapper.DatasetError, "nowhere"):
            unimapper.read_trajectory("/nowhere")
        self.assertTrue(issubclass(unimapper.DatasetError, RuntimeError))
        with self.assertRaises(ValueError):
            unimapper.open_dataset(drives.drive(), deskew="perhaps")
        with self.assertRaises(TypeError):
            unimapper.open_dataset(None)


class Evaluation(unittest.TestCase):
    """Figures are those of the tool."""

    def test_accuracy_of_labels_is_that_of_the_tool(self):
        dataset = unimapper.open_dataset(drives.drive())
        score = unimapper.LabelScore()
        self.assertTrue(np.isnan(score.dynamic_accuracy))
        for i, scan in enumerate(dataset):
            written = np.fromfile(drives.run() / "labels" / f"{scan.name}.label", np.uint32)
            labels = np.where(written == 251, unimapper.DYNAMIC, unimapper.STATIC).astype(np.uint8)
            score.add_scan(scan.points, labels, dataset.labels(i))
        told = json.loads(drives.tool("evaluate", "dynamic", "--truth", drives.drive(), "--run",
                                      drives.run()))
        self.assertEqual(100 * score.static_accuracy, told["SA"])
        self.assertEqual(100 * score.dynamic_accuracy, told["DA"])
        self.assertEqual(100 * score.associated_accuracy, told["AA"])

    def test_a_shifted_trajectory_has_no_error_once_it_is_aligned(self):
        stamps = np.arange(50) * 100_000_000
        truth = np.array([drives.pose(0.1 * i) for i in range(50)])
        truth[:, 1, 3] = np.sin(np.arange(50))
        shifted = truth.copy()
        shifted[:, 2, 3] += 3.0
        aligned = unimapper.trajectory_error(stamps, shifted, stamps, truth)
        self.assertAlmostEqual(aligned["translation_m"]["rmse"], 0.0)
        as_is = unimapper.trajectory_error(stamps, shifted, stamps, truth, np.eye(4))
        self.assertAlmostEqual(as_is["translation_m"]["rmse"], 3.0)
        self.assertEqual(as_is["translation_m"]["count"], 50)
        for wrong in ((stamps[1:], shifted), (stamps[::-1], shifted), (stamps + 10**9 * 60, shifted),
                      (stamps, shifted[:, :3]), (stamps, shifted * np.nan)):
            with self.assertRaises(ValueError):
                unimapper.trajectory_error(*wrong, stamps, truth)

    def test_clouds_are_compared(self):
        cloud = drives.street()
        agreement = unimapper.compare_clouds(cloud, cloud + np.float32(0.01), 0.5)
        self.assertAlmostEqual(agreement["ac_rmse_m"], 0.01 * 3**0.5, places=3)
        unimapper.compare_clouds(cloud[:0], cloud, 0.5)
        for first, tau_m in ((cloud * np.nan, 0.5), (cloud, 0.0), (cloud, float("nan"))):
            with self.assertRaises(ValueError):
                unimapper.compare_clouds(first, cloud, tau_m)


if __name__ == "__main__":
    unittest.main()
