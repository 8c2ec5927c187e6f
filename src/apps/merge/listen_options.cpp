// Options of `unimapper merge` for listening to live sessions.
#include "src/apps/merge/listen_options.hpp"

#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>

#include "ports/keys/guards.hpp"
#include "ports/linux/boot_id.hpp"

namespace unimapper::apps {

lcm_port::ListenOptions listen_options(const MergeOptions& options) {
  const auto milliseconds = [](double seconds) {
    return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000.0));
  };
  lcm_port::ListenOptions listening;
  listening.url = options.listen;
  if (!options.keys.empty()) {
    listening.guard = std::make_shared<keys::BaseGuard>(options.keys, linux_port::random_boot());
  }
  listening.sessions_expected = options.sessions;
  listening.first_message_timeout = milliseconds(options.first_timeout_s);
  listening.idle_timeout = milliseconds(options.idle_timeout_s);
  listening.progress = [](const std::string& text) {
    std::cerr << "unimapper: " << text << std::endl;
  };
  return listening;
}

}  // namespace unimapper::apps
