// Ranges of scans that are sessions of their own, where the odometry breaks.
#include "src/apps/onboard/session_range.hpp"

namespace unimapper::apps {

std::vector<SessionRange> session_ranges(const std::vector<input::OdometryBreak>& breaks,
                                         std::size_t scans, std::size_t fewest) {
  std::vector<SessionRange> ranges;
  std::size_t first = 0;
  const auto add = [&](std::size_t end) {
    if (end >= first + fewest) ranges.push_back({first, end});
  };
  for (const input::OdometryBreak& odometry_break : breaks) {
    if (odometry_break.next >= scans) break;
    add(odometry_break.last + 1);
    first = odometry_break.next;
  }
  add(scans);
  if (ranges.empty()) ranges.push_back({0, scans});
  return ranges;
}

std::string range_name(const std::string& run, std::size_t index) {
  return index == 0 ? run : run + "." + std::to_string(index + 1);
}

}  // namespace unimapper::apps
