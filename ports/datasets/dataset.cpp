#include "ports/datasets/dataset.hpp"

#include <array>
#include <system_error>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/pcd_sequence.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

bool holds(const fs::path& directory, std::string_view extension) {
  return !directory.empty() && !list_files(directory, extension).empty();
}

Format recognise(const fs::path& path) {
  const fs::path scans = find_child(path, {"scans", "velodyne"});
  if (holds(scans, ".bin")) return Format::kKitti;
  if (!find_child(path, {"LiDAR"}).empty()) return Format::kHelipr;
  const fs::path clouds = find_cloud_directory(path);
  if (!clouds.empty() && holds(clouds, ".pcd")) {
    const bool in_world_frame =
        !find_child(path, {"gt_cloud.pcd"}).empty() || find_poses_file(path).empty();
    return in_world_frame ? Format::kDynamicMap : Format::kPcd;
  }
  if (!scans.empty()) fail(scans, "holds no *.bin or *.pcd scans");
  if (!clouds.empty()) fail(clouds, "holds no *.pcd scans");
  fail(path,
       "not a recording of a known format: expected scans/ or velodyne/ with *.bin (kitti), "
       "Scans/ or pcd/ with *.pcd (pcd, dynamicmap), or LiDAR/ (helipr)");
}

}  // namespace

std::optional<Format> parse_format(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Format>, 5> kNames = {{
      {"auto", Format::kAuto},
      {"kitti", Format::kKitti},
      {"pcd", Format::kPcd},
      {"dynamicmap", Format::kDynamicMap},
      {"helipr", Format::kHelipr},
  }};
  for (const auto& [known, format] : kNames) {
    if (known == name) return format;
  }
  return std::nullopt;
}

std::unique_ptr<Dataset> open_dataset(const fs::path& path, Format format,
                                      const std::string& sensor) {
  std::error_code error;
  if (!fs::exists(path, error)) fail(path, "no such directory");
  if (!fs::is_directory(path, error)) fail(path, "is not a directory");
  switch (format == Format::kAuto ? recognise(path) : format) {
    case Format::kPcd:
      return open_pcd(path);
    case Format::kDynamicMap:
      return open_dynamic_map(path);
    case Format::kHelipr:
      return open_helipr(path, sensor);
    default:
      return open_kitti(path);
  }
}

}  // namespace unimapper::datasets
