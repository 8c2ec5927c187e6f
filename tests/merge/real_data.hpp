// Finds the real recordings, which lie packed beside the project.
#pragma once

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace unimapper::merge::testing {

/// Unpacks one archive of ../shared/data once per test process; empty (with a warning that the
/// test is skipped) if it is not there.
inline std::filesystem::path real_data(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path source(UNIMAPPER_SOURCE_DIR);
  const fs::path shared = source / ".." / "shared" / "data";
  if (fs::is_directory(shared / name)) return shared / name;
  const fs::path archive = shared / (name + ".tar.xz");
  if (!fs::exists(archive)) {
    WARN("skipped: no real recording " + name + " beside the project");
    return {};
  }
  static const struct Scratch {
    Scratch() {
      std::string pattern = (fs::temp_directory_path() / "unimapper-merge-XXXXXX").string();
      if (mkdtemp(pattern.data()) != nullptr) path = pattern;
    }
    ~Scratch() {
      std::error_code ignored;
      if (!path.empty()) fs::remove_all(path, ignored);
    }
    fs::path path;
  } scratch;
  if (!fs::is_directory(scratch.path / name)) {
    const std::string command =
        "tar -xJf '" + archive.string() + "' -C '" + scratch.path.string() + "'";
    if (std::system(command.c_str()) != 0 || !fs::is_directory(scratch.path / name)) {
      WARN("skipped: could not unpack " + archive.string());
      return {};
    }
  }
  return scratch.path / name;
}

}  // namespace unimapper::merge::testing
