// Refusal of rosbag2 in a build without SQLite.
#include "ports/bag_writers/containers.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {

std::unique_ptr<BagWriter> create_rosbag2(const std::filesystem::path& folder) {
  throw BagError(folder.string() + ": rosbag2 needs SQLite, and this program was built without it");
}

}  // namespace unimapper::bags
