// Thread of a base that localises robots, so that neither commits nor answers wait for it.
#pragma once

#include <vector>

#include "src/apps/base/due_map_poses.hpp"
#include "src/apps/base/live_localisation.hpp"
#include "src/apps/base/repeated_work.hpp"

namespace unimapper::apps {

/// Looks for new keyframes five times a second. Whatever fails is told in words and tried again.
class LocalisationThread {
 public:
  /// `options.answered` and `options.forgotten` are its own; `options.report` is called from its
  /// thread. Throws store::StoreError.
  explicit LocalisationThread(LiveLocalisationOptions options);

  /// What robots are to be told now. Takes a lock for a moment.
  std::vector<wire::MapPoseMessage> due() { return due_.take(DueMapPoses::Clock::now()); }
  /// Waits for the keyframe that is being localised, ends it, and says what became of keyframes.
  LiveLocalisationCounters finish();

 private:
  DueMapPoses due_;
  LiveLocalisation localisation_;  ///< the thread's own
  RepeatedWork thread_;
};

}  // namespace unimapper::apps
