// Key files: a robot's own, and a base's folder of them.
#pragma once

#include <filesystem>
#include <vector>

#include "ports/keys/key.hpp"

namespace unimapper::keys {

/// Ending of a base's key files; others in the folder are ignored.
inline constexpr char kKeyFileEnding[] = ".key";

/// Writes the robot's part to a new file that only its owner may read (0600). Throws KeyError; an
/// existing file is not overwritten.
void write_robot_key(const std::filesystem::path& file, const RobotKey& key);

/// Reads it. Throws KeyError for a file that is none, that another user owns, or whose permissions
/// let group or others in; a symbolic link is none.
[[nodiscard]] RobotKey read_robot_key(const std::filesystem::path& file);

/// Adds a robot to a base's folder, which is made (0700) if it is not there. Throws KeyError, also
/// for a name or number that is there already.
void add_base_key(const std::filesystem::path& folder, const BaseKey& key);

/// All robots of a base's folder, by name. Throws KeyError for a file that `read_robot_key` would
/// refuse, a name that is not the file's, two robots of one number, and a folder that another user
/// owns or others may write to.
[[nodiscard]] std::vector<BaseKey> read_base_keys(const std::filesystem::path& folder);

/// Marks a robot's key as revoked: its file stays, so that its name and number are not given to
/// another one. Throws KeyError if there is none, or it was revoked before.
void revoke_base_key(const std::filesystem::path& folder, const std::string& name);

}  // namespace unimapper::keys
