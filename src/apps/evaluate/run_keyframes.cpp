#include "src/apps/evaluate/run_keyframes.hpp"

#include <stdexcept>

#include "ports/lcm/received_log.hpp"
#include "src/apps/truth.hpp"

namespace unimapper::apps {

RunKeyframes read_run_keyframes(const std::filesystem::path& run,
                                const std::filesystem::path& dataset) {
  const std::filesystem::path log = run / "keyframes.lcmlog";
  const lcm_port::ReceivedLog received = lcm_port::read_event_log(log);
  if (received.sessions.size() != 1 || received.sessions.front().keyframes.empty()) {
    throw std::runtime_error(log.string() + ": holds " + std::to_string(received.sessions.size()) +
                             " sessions with keyframes; only a run of one is taken");
  }
  const SessionData& session = received.sessions.front();
  const auto truth = read_truth(dataset);
  RunKeyframes result{session.info.name, {}};
  for (const KeyframeRecord& keyframe : session.keyframes) {
    const std::uint32_t scan = keyframe.scans[keyframe.reference_scan].scan_index;
    if (scan >= truth.size()) {
      throw std::runtime_error(log.string() + ": keyframe " + std::to_string(keyframe.sequence) +
                               " is of scan " + std::to_string(scan) + ", but " + dataset.string() +
                               " has only " + std::to_string(truth.size()) +
                               " scans; run and dataset do not belong together");
    }
    result.keyframes.push_back({keyframe.sequence, scan, truth[scan].T_world_sensor});
  }
  return result;
}

}  // namespace unimapper::apps
