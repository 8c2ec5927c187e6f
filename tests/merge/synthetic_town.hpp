// Synthetic sessions in a town of walls and poles, with drifting odometry.
#pragma once

#include "src/merge/in_arena.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::merge::testing {

/// Points on all surfaces, about 0.3 m apart. Roads lie between blocks of 36 m.
struct Town {
  std::vector<Eigen::Vector3f> structure;

  static constexpr double kPitchM = 48.0;

  void add_wall(double x0, double y0, double x1, double y1, double height) {
    const double length = std::hypot(x1 - x0, y1 - y0);
    const int steps = static_cast<int>(length / 0.3) + 1;
    for (int i = 0; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      for (double z = 0.15; z < height; z += 0.3) {
        structure.emplace_back(static_cast<float>(x0 + s * (x1 - x0)),
                               static_cast<float>(y0 + s * (y1 - y0)), static_cast<float>(z));
      }
    }
  }

  void add_box(double x, double y, double width, double depth, double height) {
    add_wall(x, y, x + width, y, height);
    add_wall(x + width, y, x + width, y + depth, height);
    add_wall(x + width, y + depth, x, y + depth, height);
    add_wall(x, y + depth, x, y, height);
  }
};

/// `blocks` by `blocks` blocks with houses set back at random, walls between some, poles.
inline Town make_town(std::uint64_t seed, int blocks) {
  Random random(seed);
  Town town;
  for (int bx = 0; bx < blocks; ++bx) {
    for (int by = 0; by < blocks; ++by) {
      const double x0 = bx * Town::kPitchM + 6.0;
      const double y0 = by * Town::kPitchM + 6.0;
      for (int hx = 0; hx < 2; ++hx) {
        for (int hy = 0; hy < 2; ++hy) {
          const double width = random.uniform(8.0, 15.0);
          const double depth = random.uniform(8.0, 15.0);
          town.add_box(x0 + hx * 18.0 + random.uniform(0.0, 17.0 - width),
                       y0 + hy * 18.0 + random.uniform(0.0, 17.0 - depth), width, depth,
                       random.uniform(4.0, 9.0));
        }
      }
      for (int pole = 0; pole < 10; ++pole) {
        const double along = random.uniform(0.0, 36.0);
        const int side = static_cast<int>(random.below(4));
        const double px = side == 0 ? 0.0 : side == 1 ? 36.0 : along;
        const double py = side == 2 ? 0.0 : side == 3 ? 36.0 : along;
        town.add_box(x0 + px, y0 + py, 0.3, 0.3, random.uniform(3.0, 7.0));
      }
    }
  }
  return town;
}

/// Keyframe poses every 4 m along way points given in units of roads.
inline std::vector<Pose> drive_roads(const std::vector<Eigen::Vector2d>& crossings) {
  constexpr double kKeyframeStepM = 4.0;
  std::vector<Pose> poses;
  for (std::size_t leg = 0; leg + 1 < crossings.size(); ++leg) {
    const Eigen::Vector2d from = crossings[leg] * Town::kPitchM;
    const Eigen::Vector2d to = crossings[leg + 1] * Town::kPitchM;
    const Eigen::Vector2d direction = (to - from).normalized();
    const double yaw = std::atan2(direction.y(), direction.x());
    const int steps = static_cast<int>((to - from).norm() / kKeyframeStepM);
    for (int i = 0; i < steps; ++i) {
      const Eigen::Vector2d at = from + direction * kKeyframeStepM * i;
      poses.emplace_back(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                         Eigen::Vector3d(at.x(), at.y(), 1.7));
    }
  }
  return poses;
}

/// A session in the town, and the true keyframe poses.
struct Drive {
  SessionData session;
  std::vector<Pose> truth;
};

inline Drive record(const Town& town, const std::vector<Pose>& truth, const std::string& name,
                    std::uint64_t seed, double drift_m = 0.03, double drift_rad = 0.0008) {
  constexpr float kRangeM = 35.0F;
  Random random(seed);
  InArena<PlaceDescriber> describer(DescriptorConfig{});
  Drive drive;
  drive.truth = truth;
  drive.session.info.id = {static_cast<std::uint32_t>(seed), seed};
  drive.session.info.name = name;
  drive.session.info.sensor = "os2-128";
  drive.session.complete = true;
  Pose odometry(
      Eigen::Quaterniond(Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Eigen::Vector3d::UnitZ())),
      random.normal3(50.0));
  for (std::size_t k = 0; k < truth.size(); ++k) {
    if (k > 0) {
      // Gravity is known, so odometry turns about the vertical only.
      const Pose noise(Eigen::Quaterniond(Eigen::AngleAxisd(drift_rad * random.normal(),
                                                            Eigen::Vector3d::UnitZ())),
                       random.normal3(drift_m));
      odometry = odometry * truth[k - 1].inverse() * truth[k] * noise;
    }
    KeyframeRecord keyframe;
    keyframe.session = drive.session.info.id;
    keyframe.sequence = static_cast<std::uint32_t>(k);
    keyframe.T_odometry_keyframe = odometry;
    for (std::uint32_t scan = 0; scan < 3; ++scan) {
      keyframe.scans.push_back({static_cast<std::uint32_t>(3 * k + scan),
                                1000000000LL * static_cast<std::int64_t>(seed) +
                                    100000000LL * static_cast<std::int64_t>(3 * k + scan),
                                odometry});
    }
    keyframe.reference_scan = 1;
    const Pose T_keyframe_world = truth[k].inverse();
    for (const auto& p : town.structure) {
      const Eigen::Vector3d local = T_keyframe_world * Eigen::Vector3d(p.cast<double>());
      if (local.head<2>().squaredNorm() > static_cast<double>(kRangeM * kRangeM)) continue;
      keyframe.static_cells.push_back({(local + random.normal3(0.02)).cast<float>(), 3, 0, 0});
    }
    for (float x = -16.0F; x < 16.0F; x += 0.4F) {
      for (float y = -16.0F; y < 16.0F; y += 0.4F) {
        const auto z = static_cast<float>(-1.7 + 0.02 * random.normal());
        keyframe.static_cells.push_back({Eigen::Vector3f(x, y, z), 3, 1, 0});
      }
    }
    const PlaceView place = describer->describe(keyframe.static_cells);
    keyframe.keypoints.assign(place.keypoints.begin(), place.keypoints.end());
    keyframe.planes.assign(place.planes.begin(), place.planes.end());
    keyframe.points_in = 10 * keyframe.static_cells.size();
    drive.session.keyframes.push_back(std::move(keyframe));
  }
  return drive;
}

/// Two robots that drive the same way through a small town.
inline std::vector<Drive> same_way(const std::vector<Eigen::Vector2d>& crossings) {
  const Town town = make_town(5, 1);
  return {record(town, drive_roads(crossings), "alpha", 1),
          record(town, drive_roads(crossings), "beta", 2)};
}

}  // namespace unimapper::merge::testing
