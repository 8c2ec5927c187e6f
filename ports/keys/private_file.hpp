// Files that only their owner may read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace unimapper::keys {

/// What writing does where a file is.
enum class Existing : std::uint8_t { kRefuse, kReplace };

/// The content of a small file that belongs to this user and whose permissions let nobody else in.
/// Throws KeyError otherwise, also for a symbolic link and for more than 4096 bytes.
[[nodiscard]] std::string read_private(const std::filesystem::path& file);

/// Writes such a file, whole or not at all, and waits until it is on the disk. Throws KeyError.
void write_private(const std::filesystem::path& file, std::string_view text, Existing existing);

/// Throws KeyError unless this is a folder of this user to which nobody else may write.
void check_private_folder(const std::filesystem::path& folder);

/// Makes it, for this user only, if it is not there; throws KeyError where that fails.
void make_private_folder(const std::filesystem::path& folder);

}  // namespace unimapper::keys
