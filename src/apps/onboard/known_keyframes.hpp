// Keyframes that loops may refer to: of this run and of earlier ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "src/core/loop_record.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::apps {

/// One session of earlier runs, read for `--against`.
struct EarlierSession {
  std::string name;
  std::vector<KeyframeRecord> keyframes;
};

/// Reads RUN/keyframes.lcmlog of every run; sessions keep the runs' folder names. Faults of
/// a log are added to `faults`. Throws std::runtime_error if a run has no keyframe.
std::vector<EarlierSession> read_earlier_runs(const std::vector<std::filesystem::path>& runs,
                                              std::vector<std::string>& faults);

/// Turns candidates between levelled keyframes into records between the sensors of reference scans.
class KnownKeyframes {
 public:
  KnownKeyframes(std::string session_name, const std::vector<EarlierSession>& earlier);

  /// Inserts the places of the earlier sessions into `places`, as sessions 1, 2, ...
  void insert_into(PlaceDatabase& places) const;

  /// Adds a keyframe of this run. Must be called once for each, in order.
  void add(const KeyframeView& keyframe);

  /// The record of a candidate found for the keyframe added last.
  [[nodiscard]] LoopRecord record(const LoopCandidate& candidate) const;

 private:
  struct Known {
    std::uint32_t sequence = 0;
    std::uint32_t scan = 0;  // index of the reference scan in its recording
    Pose T_keyframe_sensor;  // of the reference scan
  };
  struct Session {
    std::string name;
    std::vector<Known> keyframes;  // ascending in sequence
  };
  [[nodiscard]] const Known& find(const KeyframeId& id) const;

  const std::vector<EarlierSession>& earlier_;
  std::vector<Session> sessions_;  // the run's own first
};

}  // namespace unimapper::apps
