// Sessions of a map as its page shows them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace unimapper::apps {

/// A session of view/map.json; its keyframes in their order there.
struct ShownSession {
  std::string name;
  std::vector<std::uint32_t> sequences;
  std::vector<std::int64_t> stamps_ns;
  std::vector<Eigen::Vector3d> positions;  ///< map frame, metres
};

/// Reads MAP/view/map.json. Throws std::runtime_error naming the file and what is wrong with it.
[[nodiscard]] std::vector<ShownSession> read_shown_map(const std::filesystem::path& map);

}  // namespace unimapper::apps
