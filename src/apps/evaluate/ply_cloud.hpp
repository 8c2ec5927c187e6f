// Reader of vertex positions from PLY files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace unimapper::apps {

/// The finite positions of a binary little-endian PLY whose vertices have float x, y and z and
/// any further properties without lists: what `write_ply` writes. Throws DatasetError with the
/// reason for anything else.
[[nodiscard]] std::vector<Eigen::Vector3f> read_ply_positions(const std::filesystem::path& file);

}  // namespace unimapper::apps
