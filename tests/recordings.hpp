// Location of the real recordings beside the project.
#pragma once

#include <stdlib.h>  // NOLINT: mkdtemp is POSIX

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "tests/folders.hpp"

namespace unimapper::testing {

/// The folder of recording `name`, unpacked once into the build directory where it is an
/// archive; empty, with a warning that says so, where the recordings are not there. Tests may
/// ask at the same time: each unpacks for itself, the first one to finish wins.
inline std::filesystem::path find_recording(const std::string& name) {
  namespace fs = std::filesystem;
  const fs::path shared = fs::path(source_folder()) / ".." / "shared" / "data";
  if (fs::is_directory(shared / name)) return shared / name;
  const fs::path archive = shared / (name + ".tar.xz");
  if (!fs::exists(archive)) {
    WARN("skipped: the recording " + name + " is not beside the project");
    return {};
  }
  const fs::path unpacked = fs::path(recordings_folder());
  if (fs::is_directory(unpacked / name)) return unpacked / name;
  fs::create_directories(unpacked);
  std::string scratch = (unpacked / "unpacking-XXXXXX").string();
  if (mkdtemp(scratch.data()) == nullptr) return {};
  const std::string command = "tar -xJf '" + archive.string() + "' -C '" + scratch + "'";
  std::error_code error;
  if (std::system(command.c_str()) == 0)
    fs::rename(fs::path(scratch) / name, unpacked / name, error);
  fs::remove_all(scratch, error);
  if (fs::is_directory(unpacked / name)) return unpacked / name;
  WARN("skipped: cannot unpack " + archive.string());
  return {};
}

}  // namespace unimapper::testing
