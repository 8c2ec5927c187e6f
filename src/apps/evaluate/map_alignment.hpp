// Alignment of a merged map to the truth by its central session.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::apps {

/// Sessions of a map, by name, and the datasets with their truth.
using SessionTruths = std::vector<std::pair<std::string, std::filesystem::path>>;

/// The poses of one session of a map with the truth at the same instants.
struct PairedSession {
  std::string name;
  std::string status;                             ///< as summary.json has it
  std::vector<evaluate::StampedPose> truth{};     ///< as `read_truth` reads it
  std::vector<evaluate::StampedPose> estimate{};  ///< map frame; none outside the map
  std::vector<evaluate::PosePair> pairs{};        ///< of the estimate with the truth
};

/// One for each of `truths`. Throws std::runtime_error with a sentence for the user: no such
/// session, or a dataset of another drive.
[[nodiscard]] std::vector<PairedSession> pair_sessions(const std::filesystem::path& map,
                                                       const SessionTruths& truths);

/// Aligns the central session, whose frame is the map's. Throws std::runtime_error if it is not
/// among them.
[[nodiscard]] evaluate::Alignment align_central(const std::vector<PairedSession>& sessions);

}  // namespace unimapper::apps
