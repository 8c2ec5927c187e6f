// List of the writers of containers.
#pragma once

#include <filesystem>
#include <memory>

#include "ports/bag_writers/bag_writer.hpp"

namespace unimapper::bags {

[[nodiscard]] std::unique_ptr<BagWriter> create_mcap(const std::filesystem::path& file);
[[nodiscard]] std::unique_ptr<BagWriter> create_rosbag1(const std::filesystem::path& file);
[[nodiscard]] std::unique_ptr<BagWriter> create_rosbag2(const std::filesystem::path& folder);

}  // namespace unimapper::bags
