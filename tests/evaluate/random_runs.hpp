// Random runs to be evaluated, in any frame
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "src/evaluate/loops.hpp"
#include "src/evaluate/map_quality.hpp"
#include "tests/evaluate/labelled_scan.hpp"
#include "tests/merge/random.hpp"
#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::evaluate::testing {

using merge::testing::Random;

/// A turn about any axis and a translation along all of them, of the given deviations.
inline Pose random_motion(std::uint64_t seed, double sigma_m, double sigma_rad) {
  Random random(seed + 5000);
  return random.pose(sigma_m, sigma_rad);
}

struct RandomTracks {
  std::vector<StampedPose> estimate;
  std::vector<StampedPose> truth;
};

/// A climbing, winding track; the estimate is shaky, at other times, and in another frame.
inline RandomTracks random_tracks(std::uint64_t seed) {
  Random random(seed);
  RandomTracks tracks;
  const Pose T_estimate_truth = random.pose(40.0, 0.8);
  Pose pose = random.pose(100.0, 1.0);
  for (int i = 0; i < 120; ++i) {
    const std::int64_t stamp_ns = 1'000'000'000LL + 100'000'000LL * i;
    tracks.truth.push_back({stamp_ns, pose});
    const auto late = static_cast<std::int64_t>(random.uniform(-40e6, 40e6));
    if (i % 7 != 3) {
      tracks.estimate.push_back(
          {stamp_ns + late, T_estimate_truth * pose * random.pose(0.1, 0.02)});
    }
    const Pose step(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.05});
    pose = pose * step * random.pose(0.0, 0.05);
  }
  return tracks;
}

struct RandomLoops {
  std::vector<TrueKeyframe> keyframes;
  std::vector<LoopRecord> loops;
  std::vector<std::uint8_t> common_view;
};

/// Two and a half rounds of a circle, and loops of which some are right.
inline RandomLoops random_loops(std::uint64_t seed, const Pose& T_new_world) {
  Random random(seed);
  RandomLoops run;
  for (std::uint32_t i = 0; i < 50; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / 20.0;
    const Pose pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                    {30.0 * std::cos(angle), 30.0 * std::sin(angle), 0.1 * i});
    run.keyframes.push_back({2 * i, 10 * i + 5, T_new_world * pose * random.pose(0.5, 0.05)});
  }
  for (int i = 0; i < 140; ++i) {
    const auto q = random.below(50);
    const bool right = random.uniform() < 0.6;
    const auto m = right && q >= 20 ? q - 20 : random.below(50);
    LoopRecord loop;
    loop.query_keyframe = run.keyframes[q].keyframe + (i % 40 == 39 ? 1 : 0);
    loop.match_keyframe = run.keyframes[m].keyframe;
    loop.confidence = std::round(100.0 * random.uniform()) / 100.0;
    loop.accepted = loop.confidence > 0.4;
    loop.T_match_query = run.keyframes[m].T_world_sensor.inverse() *
                         run.keyframes[q].T_world_sensor * random.pose(0.5, 0.03);
    run.loops.push_back(loop);
  }
  for (int i = 0; i < 2500; ++i) {
    run.common_view.push_back(static_cast<std::uint8_t>(random.below(5) == 0 ? 1 : 0));
  }
  return run;
}

/// Ten scans of objects that move and stand, with right and wrong labels, in a world that lies
/// anywhere.
class RandomScans : public MemorySource {
 public:
  RandomScans(std::uint64_t seed, const Pose& T_new_world) {
    Random random(seed);
    constexpr std::uint32_t kLabels[] = {0, 1, 10, 40, 50, 80, 252, 253, 254, 259, 30};
    for (int s = 0; s < 10; ++s) {
      LabelledScan& scan = scans.emplace_back();
      const Pose T_world_sensor =
          Pose(Eigen::Matrix3d::Identity(), {0.8 * s, 0.1 * s, 1.5}) * random.pose(0.1, 0.02);
      scan.T_world_sensor = T_new_world * T_world_sensor;
      for (std::uint32_t object = 1; object <= 11; ++object) {
        const std::uint32_t label = kLabels[object - 1];
        const double moved = label > 250 && object % 2 == 0 ? 0.7 * s : 0.0;
        const Eigen::Vector3d center(6.0 * object - 30.0 + moved, 3.0 * (object % 5) - 6.0, 0.0);
        for (int i = 0; i < 60; ++i) {
          const Eigen::Vector3d p =
              T_world_sensor.inverse() * Eigen::Vector3d(center + random.normal3(0.4));
          const bool right = random.uniform() < 0.8;
          scan.add(p.cast<float>(), label | (object << 16U),
                   (label > 250) == right ? kRemoved : (i % 3 == 0 ? 0U : kKept));
        }
      }
    }
  }
};

/// Points on walls and ground about the origin, moved.
inline std::vector<Eigen::Vector3f> random_cloud(std::uint64_t seed, const Pose& T_new_old,
                                                 std::size_t points) {
  Random random(seed);
  std::vector<Eigen::Vector3f> cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const double u = random.uniform(-8.0, 8.0);
    const double v = random.uniform(0.0, 5.0);
    Eigen::Vector3d p(u, 3.0 * v - 7.0, 0.0);
    if (i % 3 == 1) p = {u, 6.0, v};
    if (i % 3 == 2) p = {-7.0, u, v};
    cloud.push_back((T_new_old * Eigen::Vector3d(p + random.normal3(0.03))).cast<float>());
  }
  return cloud;
}

}  // namespace unimapper::evaluate::testing
