#include "src/apps/keys/run_keys.hpp"

#include <iomanip>
#include <ostream>
#include <system_error>

#include "ports/keys/key_files.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

void new_key(const std::string& name, const fs::path& out, const fs::path& folder,
             std::ostream& says) {
  const keys::RobotKey key = keys::new_robot_key(name);
  const keys::BaseKey base = keys::base_key_of(key);
  keys::write_robot_key(out, key);
  try {
    keys::add_base_key(folder, base);
  } catch (...) {
    std::error_code ignored;
    fs::remove(out, ignored);
    throw;
  }
  says << "robot " << name << ", number " << key.robot << ", fingerprint "
       << keys::fingerprint(base) << "\nmove " << out.string()
       << " to the robot (unimapper onboard --key); " << folder.string()
       << " stays at the base (--keys)\n";
}

void list_keys(const fs::path& folder, std::ostream& says) {
  says << std::left << std::setw(24) << "robot" << std::setw(12) << "number" << std::setw(13)
       << "fingerprint"
       << "state\n";
  for (const keys::BaseKey& key : keys::read_base_keys(folder)) {
    says << std::setw(23) << key.name << ' ' << std::setw(12) << key.robot << std::setw(13)
         << keys::fingerprint(key) << (key.revoked ? "revoked" : "accepted") << '\n';
  }
}

void revoke_key(const std::string& name, const fs::path& folder, std::ostream& says) {
  keys::revoke_base_key(folder, name);
  says << "the key of " << name
       << " is revoked; a base that listens takes nothing of it from the next second on\n";
}

}  // namespace unimapper::apps
