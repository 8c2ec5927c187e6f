// Drift of odometry, estimated from loops: fleets that drift as modelled, more, and one robot alone
#include "src/merge/graph/drift_scale.hpp"

#include "tests/merge/alignment_scene.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Estimates of sessions along one drive, each with loops to the one before, whose odometry drifts
/// so many times as modelled.
std::vector<double> estimated(const std::vector<double>& drifts, std::size_t loops_per_pair) {
  Random random(17);
  Scene scene;
  const std::vector<Pose> way = drive(random, 200, Pose{});
  std::vector<SessionPath> paths;
  for (std::size_t s = 0; s < drifts.size(); ++s) {
    paths.emplace_back(odometry(random, way, drifts[s]), OdometryNoiseConfig{});
    for (std::size_t i = 0; s > 0 && i < loops_per_pair; ++i) {
      const std::size_t k = i * way.size() / loops_per_pair;
      loop(scene, {s, k}, {s - 1, k}, Pose{}, random);
    }
  }
  return drift_scales(scene.loops, paths);
}

}  // namespace

TEST_CASE("Odometry that drifts as modelled, or less, has a scale of exactly 1", "[drift_scale]") {
  CHECK(estimated(std::vector<double>(6, 1.0), 12) == std::vector<double>(6, 1.0));
  CHECK(estimated(std::vector<double>(6, 0.2), 12) == std::vector<double>(6, 1.0));
}

TEST_CASE("One robot that drifts more than the others has the largest scale", "[drift_scale]") {
  const std::vector<double> scales = estimated({1.0, 1.0, 1.0, 4.0, 1.0, 1.0, 1.0}, 20);
  for (std::size_t s = 0; s < scales.size(); ++s) {
    if (s != 3) CHECK(scales[s] < 0.7 * scales[3]);
  }
  CHECK(scales[3] > 1.7);
}

TEST_CASE("Without loops, or with few sessions, drift is as modelled", "[drift_scale]") {
  CHECK(estimated(std::vector<double>(6, 3.0), 1) == std::vector<double>(6, 1.0));
  CHECK(estimated(std::vector<double>(6, 3.0), 0) == std::vector<double>(6, 1.0));
  CHECK(estimated(std::vector<double>(5, 3.0), 12) == std::vector<double>(5, 1.0));
}

TEST_CASE("Alignment says which sessions drift, and connects a fleet that drifts farther",
          "[drift_scale][alignment]") {
  const auto fleet = [](double drift, double moved_m) {
    Random random(23);
    Scene scene;
    const std::vector<Pose> way = drive(random, 200, Pose{});
    for (std::size_t s = 0; s < 7; ++s) {
      scene.sessions.push_back({odometry(random, way, drift), 1.0});
      for (std::size_t match = 0; match < s; ++match) {
        // The last session's loops with every other one say that it is elsewhere.
        const bool is_moved = s == 6 && match % 2 == 1;
        for (std::size_t k = 5; k < way.size(); k += 16) {
          const Pose moved = shifted(0.0, is_moved ? moved_m : 0.0);
          loop(scene, {s, k}, {match, k}, way[k].inverse() * moved * way[k], random);
        }
      }
    }
    return align(scene);
  };
  const Alignment drifting = fleet(3.0, 0.0);
  CHECK(drifting.connected == std::vector<bool>(7, true));
  for (const double scale : drifting.drift_scale) {
    CHECK(scale > 1.5);
    CHECK(scale < 3.5);
  }
  CHECK(fleet(1.0, 0.0).drift_scale == std::vector<double>(7, 1.0));
  CHECK(fleet(1.0, 10.0).drift_scale == std::vector<double>(7, 1.0));
}
