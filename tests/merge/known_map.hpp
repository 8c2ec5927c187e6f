// Map of a synthetic town, and a drive on another day through it.
#pragma once

#include "tests/merge/synthetic_town.hpp"
#include "unimapper/merge/localisation.hpp"

namespace unimapper::merge::testing {

/// A map of one session whose poses are the truth: the world is its frame.
struct KnownMap {
  Drive drive;
  MergeResult result;

  explicit KnownMap(const Town& town)
      : drive(record(town, drive_roads({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {0.5, 0}}),
                     "monday", 11)) {
    MergedSession& merged = result.sessions.emplace_back();
    merged.status = SessionStatus::kCentral;
    merged.T_map_keyframe = drive.truth;
  }
  [[nodiscard]] Localiser localiser() const { return {{drive.session}, result}; }
};

inline const KnownMap& map_of_town() {
  static const KnownMap shared(make_town(1, 2));
  return shared;
}

/// Another day's drive that begins outside of the map.
inline const Drive& friday() {
  static const Drive shared =
      record(make_town(1, 2), drive_roads({{2, 1}, {0, 1}, {0, 0}}), "friday", 12);
  return shared;
}

}  // namespace unimapper::merge::testing
