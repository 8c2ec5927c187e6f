#include "ports/datasets/readers.hpp"

#include <algorithm>
#include <array>
#include <system_error>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::array<Reader, 4> kReaders = {{
    {"kitti", "scans/ or velodyne/ with *.bin, poses.txt with one pose a scan", &recognises_kitti,
     &open_kitti},
    {"helipr", "LiDAR/SENSOR/ with *.bin, LiDAR_GT/SENSOR_gt.txt", &recognises_helipr,
     &open_helipr},
    {"dynamicmap", "pcd/ with *.pcd in the world frame, the sensor's pose in VIEWPOINT",
     &recognises_dynamic_map, &open_dynamic_map},
    {"pcd", "Scans/ or pcd/ with *.pcd, poses.txt in TUM or KITTI form", &recognises_pcd,
     &open_pcd},
}};

}  // namespace

std::span<const Reader> readers() { return kReaders; }

const Reader* find_reader(std::string_view name) {
  const auto found = std::find_if(kReaders.begin(), kReaders.end(),
                                  [&](const Reader& reader) { return reader.name == name; });
  return found == kReaders.end() ? nullptr : &*found;
}

const Reader& recognise(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) fail(path, "no such file or directory");
  for (const Reader& reader : kReaders) {
    if (reader.recognises(path)) return reader;
  }
  std::string expected;
  for (const Reader& reader : kReaders) {
    expected += (expected.empty() ? "" : "; ") + std::string(reader.name) + ": " +
                std::string(reader.description);
  }
  fail(path, "not a recording of a known format. Expected is one of " + expected);
}

std::string format_names() {
  std::string names = "auto";
  for (const Reader& reader : kReaders) names += ", " + std::string(reader.name);
  return names;
}

}  // namespace unimapper::datasets
