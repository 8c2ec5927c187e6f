// Files of an exported map
#pragma once

#include "tests/test.hpp"

namespace unimapper::merge::testing {

inline std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Every exported file but the durations.
inline std::map<std::string, std::string> exported_files(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
    files[entry.path().lexically_relative(folder).string()] = read(entry.path());
  }
  return files;
}

}  // namespace unimapper::merge::testing
