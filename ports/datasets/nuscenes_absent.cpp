// Stand-in for the reader of nuScenes where the JSON library is not there.
#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/nuscenes.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void refuse(const fs::path& path) {
  fail(path, "nuScenes is not read: built without nlohmann-json3-dev");
}

}  // namespace

std::vector<std::string> parse_nuscenes_scenes(const NuScenesTable& /*table*/,
                                               const fs::path& folder) {
  refuse(folder);
}

std::vector<NuScenesSweep> parse_nuscenes_sweeps(const NuScenesTable& /*table*/,
                                                 const std::string& /*name*/,
                                                 const fs::path& folder) {
  refuse(folder);
}

bool recognises_nuscenes(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return false;
  for (const fs::path& child : list_directories(directory)) {
    if (child.filename().string().starts_with("v1.0-")) return true;
  }
  return false;
}

std::unique_ptr<Dataset> open_nuscenes(const fs::path& directory, const OpenOptions& /*options*/) {
  refuse(directory);
}

}  // namespace unimapper::datasets
