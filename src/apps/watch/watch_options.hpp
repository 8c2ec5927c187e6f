// Options of `unimapper watch`.
#pragma once

#include <cstdint>
#include <string>

namespace unimapper::apps {

struct WatchOptions {
  std::string name;             ///< of the share; empty: the only one
  std::uint64_t keyframes = 0;  ///< to show before it ends; 0: until the robot ends
  double wait_s = 0.0;          ///< for a robot to appear
  bool from_oldest = false;     ///< begin with the oldest keyframe
};

/// Shows what a robot shares until it ends. Throws std::exception with a sentence for the user.
void run_watch(const WatchOptions& options);

}  // namespace unimapper::apps
