// Objects that stand in a simulated scene.
#pragma once

#include <filesystem>
#include <vector>

#include "src/evaluate/changed_objects.hpp"

namespace unimapper::apps {

/// Objects of the recording in `directory`, from objects.txt. Throws std::runtime_error naming the
/// file, and the line that is none.
[[nodiscard]] std::vector<evaluate::StandingObject> read_objects(
    const std::filesystem::path& directory);

/// How often each object was hit, and seen through, by the scans of a recording.
struct ObjectSightings {
  std::vector<std::size_t> scans_hit;           ///< scans with returns from within its box
  std::vector<std::size_t> scans_seen_through;  ///< scans with rays that went through its box
};

/// Sightings of boxes (world frame of the ground truth) from at most `reach_m` away. O(returns x
/// boxes near by). Throws DatasetError.
[[nodiscard]] ObjectSightings count_sightings(const std::filesystem::path& recording,
                                              const std::vector<UprightBox>& boxes, double reach_m);

/// Returns from within a box, by what was hit.
struct BoxReturns {
  std::size_t standing = 0;  ///< persons and vehicles that stood still
  std::size_t others = 0;    ///< what moved, and the scene itself
};

/// Returns from within boxes, grown by a decimetre, by their labels. As `count_sightings`.
[[nodiscard]] std::vector<BoxReturns> count_returns(const std::filesystem::path& recording,
                                                    const std::vector<UprightBox>& boxes,
                                                    double reach_m);

}  // namespace unimapper::apps
