// Map of a synthetic town, and a drive on another day through it.
#pragma once

#include "tests/merge/synthetic_town.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/localisation.hpp"

namespace unimapper::merge::testing {

inline const Town& known_town() {
  static const Town shared = make_town(1, 2);
  return shared;
}

inline std::vector<Pose> mondays_way() {
  return drive_roads({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {0.5, 0}});
}
/// It begins outside of the map.
inline std::vector<Pose> fridays_way() { return drive_roads({{2, 1}, {0, 1}, {0, 0}}); }

/// A map of one session whose poses are the truth: the world is its frame.
struct KnownMap {
  Drive drive;
  MergeResult result;

  explicit KnownMap(const Town& town) : drive(record(town, mondays_way(), "monday", 11)) {
    MergedSession& merged = result.sessions.emplace_back();
    merged.status = SessionStatus::kCentral;
    merged.T_map_keyframe = drive.truth;
  }
  [[nodiscard]] Localiser localiser() const { return {{drive.session}, result}; }
};

inline const KnownMap& map_of_town() {
  static const KnownMap shared(known_town());
  return shared;
}

/// Another day's drive.
inline const Drive& friday() {
  static const Drive shared = record(known_town(), fridays_way(), "friday", 12);
  return shared;
}

/// In another town, along three streets.
inline Drive elsewhere(std::uint64_t town, const std::string& name = "elsewhere") {
  return record(make_town(town, 2), drive_roads({{0, 0}, {1, 0}, {1, 1}}), name, 13);
}

/// Largest distance of the sessions' keyframes from the truth, in the frame of the first one.
inline double worst_error_m(const MergeResult& result, const std::vector<const Drive*>& drives) {
  const Pose T_map_world = result.sessions[0].T_map_keyframe[0] * drives[0]->truth[0].inverse();
  double worst = 0.0;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    for (std::size_t k = 0; k < result.sessions[s].T_map_keyframe.size(); ++k) {
      const Pose truth = T_map_world * drives[s]->truth[k];
      const Eigen::Vector3d& at = result.sessions[s].T_map_keyframe[k].translation;
      worst = std::max(worst, (truth.translation - at).norm());
    }
  }
  return worst;
}

}  // namespace unimapper::merge::testing
