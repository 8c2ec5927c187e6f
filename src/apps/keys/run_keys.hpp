// Steps of `unimapper keys`.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>

namespace unimapper::apps {

/// Makes keys for a robot: its own part in the new file `out`, the base's in the folder `keys`.
/// Says what to do with them. Throws keys::KeyError, and leaves neither then.
void new_key(const std::string& name, const std::filesystem::path& out,
             const std::filesystem::path& keys, std::ostream& says);

/// Lists a base's keys: name, number, fingerprint, and whether they hold. Throws keys::KeyError.
void list_keys(const std::filesystem::path& keys, std::ostream& says);

/// Revokes a robot's key. Throws keys::KeyError.
void revoke_key(const std::string& name, const std::filesystem::path& keys, std::ostream& says);

}  // namespace unimapper::apps
