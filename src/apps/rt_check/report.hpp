// Report of the real-time capability check as text and JSON.
#pragma once

#include <string>
#include <vector>

#include "ports/linux/host.hpp"
#include "ports/linux/wakeup.hpp"

namespace unimapper::apps {

/// Everything that was looked at and measured.
struct RtReport {
  std::vector<linux_port::Finding> findings;
  linux_port::WakeupLatency wakeup;
  linux_port::PrefaultTrial prefault;

  /// Names of what is needed and not allowed, separated by commas; empty if all is.
  [[nodiscard]] std::string refused() const;
  [[nodiscard]] std::string to_text() const;
  [[nodiscard]] std::string to_json() const;
};

}  // namespace unimapper::apps
