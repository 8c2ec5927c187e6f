// Reader of vertex positions from PLY files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace unimapper::apps {

/// The finite positions of a PLY file's vertices (`parse_ply`). Throws DatasetError with the
/// reason.
[[nodiscard]] std::vector<Eigen::Vector3f> read_ply_positions(const std::filesystem::path& file);

}  // namespace unimapper::apps
