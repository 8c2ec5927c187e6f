// Tests of stamps and of figures of whole tracks
#include "src/input/stamps.hpp"

#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "src/core/pose_interpolation.hpp"
#include "tests/input/examined.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

TEST_CASE("Scans of keyframes metres apart are too sparse to remove what moves") {
  MotionFigures figures;
  figures.scans = 20;
  figures.interval_s = 0.1;
  figures.step_m = 3.6;  // 130 km/h
  CHECK(check_spacing(figures).severity == Severity::kFine);
  figures.interval_s = 0.5;
  figures.step_m = 5.1;
  CHECK(check_spacing(figures).severity == Severity::kSuspicious);
  CHECK_THAT(check_spacing(figures).message, Contains("5.1 m and 0.5 s apart"));
}

TEST_CASE(
    "far positions in single precision are told by their steps, near and whole ones are not") {
  const auto rounding_m = [](double far_m, bool is_rounded) {
    const Track track{30,
                      [&](std::size_t i) {
                        Pose pose;
                        pose.translation.y() = far_m + 0.73 * static_cast<double>(i);
                        if (is_rounded) {
                          const auto rounded = static_cast<float>(pose.translation.y());
                          pose.translation.y() = static_cast<double>(rounded);
                        }
                        return pose;
                      },
                      [](std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }};
    return check_rounding(measure_motion(track));
  };
  CHECK(rounding_m(5'411'904.557, false).severity == Severity::kFine);
  CHECK(rounding_m(12.0, true).severity == Severity::kFine);
  CHECK(rounding_m(448'262.318, true).severity == Severity::kSuspicious);
  const Finding far = rounding_m(5'411'904.557, true);
  CHECK(far.severity == Severity::kWrong);
  CHECK(far.figure == 0.5);
  CHECK_THAT(far.message, Contains("rounded to 0.50 m") && Contains("relative to the first pose"));
}

TEST_CASE("earth-centred positions are told from far ones on a level") {
  const auto frame_at = [](const Eigen::Vector3d& origin) {
    const Track track{3,
                      [&](std::size_t i) {
                        Pose pose(Eigen::Matrix3d::Identity(), origin);
                        pose.translation.x() += static_cast<double>(i);
                        return pose;
                      },
                      [](std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }};
    return check_frame(measure_motion(track));
  };
  CHECK(frame_at({500'000.0, 6'350'000.0, 300.0}).severity == Severity::kFine);  // UTM
  CHECK(frame_at({0.0, 0.0, 0.0}).severity == Severity::kFine);
  const Finding found = frame_at({4'160'000.0, 660'000.0, 4'780'000.0});
  CHECK(found.severity == Severity::kWrong);
  CHECK_THAT(found.message, Contains("(ECEF)") && Contains("UTM"));
}

/// Every n-th pose as it is, those between interpolated.
MemoryDataset with_every(MemoryDataset recording, std::size_t n) {
  const std::vector<Pose> poses = recording.poses;
  for (std::size_t i = 0; i + n < poses.size(); i += n) {
    for (std::size_t k = 1; k < n; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(n);
      recording.poses[i + k] = interpolate(poses[i], poses[i + n], share);
    }
  }
  return recording;
}

TEST_CASE("poses that were interpolated between few are told by their straight stretches") {
  const auto rate_of = [](const MemoryDataset& recording) {
    return measure_pose_rate({recording.poses.size(),
                              [&](std::size_t i) { return recording.poses[i]; },
                              [&](std::size_t i) { return recording.stamps_ns[i]; }});
  };
  CHECK(rate_of(drive()).interval_s == 0.0);
  const PoseRate rate = rate_of(with_every(drive(), 5));
  CHECK(rate.interval_s == Approx(0.5));
  CHECK(is_too_sparse(rate));
  Finding other{"mount", Severity::kWrong, 2.0, "degrees", "yaw by 2 degrees", {}};
  const Finding found = check_pose_rate(rate, other);
  CHECK(found.severity == Severity::kWrong);
  CHECK_THAT(found.message, Contains("poses are 0.50 s apart") && Contains("yaw by 2 degrees"));
}

TEST_CASE("stamps that do not fit are said") {
  MemoryDataset recording = short_drive();
  std::vector<std::int64_t>& stamps_ns = recording.stamps_ns;
  SECTION("milliseconds read as seconds") {
    for (std::int64_t& stamp : stamps_ns) stamp *= 1000;
    CHECK_THAT(examined(recording), Contains("wrong interval: ") && Contains("milliseconds"));
  }
  SECTION("seconds read as microseconds: faster than any robot") {
    for (std::int64_t& stamp : stamps_ns) stamp /= 1000000;
    CHECK_THAT(examined(recording), Contains("wrong speed: ") && Contains("stamps in seconds"));
  }
  SECTION("all equal") {
    for (std::int64_t& stamp : stamps_ns) stamp = 5;
    CHECK_THAT(examined(recording), Contains("wrong order of stamps: ") && Contains("unit"));
  }
  SECTION("two exchanged") {
    std::swap(stamps_ns[2], stamps_ns[3]);
    CHECK_THAT(examined(recording), Contains("suspicious order of stamps: "));
  }
}
