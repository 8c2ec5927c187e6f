#include "src/apps/onboard/known_keyframes.hpp"

#include <algorithm>
#include <stdexcept>

#include "ports/lcm/received_log.hpp"
#include "src/merge/sessions/plane_restorer.hpp"
#include "unimapper/merge/keyframe_level.hpp"

namespace unimapper::apps {

std::vector<EarlierSession> read_earlier_runs(const std::vector<std::filesystem::path>& runs,
                                              std::vector<std::string>& faults) {
  std::vector<EarlierSession> sessions;
  for (const std::filesystem::path& run : runs) {
    lcm_port::ReceivedLog log = lcm_port::read_event_log(run / "keyframes.lcmlog");
    faults.insert(faults.end(), log.faults.begin(), log.faults.end());
    for (SessionData& session : log.sessions) {
      if (session.keyframes.empty()) continue;
      (void)merge::level_keyframes(session.keyframes);
      sessions.push_back({session.info.name, std::move(session.keyframes)});
    }
    if (sessions.empty()) {
      throw std::runtime_error((run / "keyframes.lcmlog").string() + ": holds no keyframe");
    }
  }
  return sessions;
}

KnownKeyframes::KnownKeyframes(std::string session_name, const std::vector<EarlierSession>& earlier)
    : earlier_(earlier) {
  sessions_.push_back({std::move(session_name), {}});
  for (const EarlierSession& session : earlier_) {
    Session& known = sessions_.emplace_back(Session{session.name, {}});
    for (const KeyframeRecord& record : session.keyframes) {
      const KeyframeScan& scan = record.scans.at(record.reference_scan);
      known.keyframes.push_back({record.sequence, scan.scan_index,
                                 record.T_odometry_keyframe.inverse() * scan.T_odometry_sensor});
    }
  }
}

void KnownKeyframes::insert_into(PlaceDatabase& places) const {
  merge::PlaneRestorer planes;
  std::uint32_t number = 1;
  for (const EarlierSession& session : earlier_) {
    for (const KeyframeRecord& record : session.keyframes) {
      places.insert(planes.place(record), {number, record.sequence}, record.T_odometry_keyframe);
    }
    ++number;
  }
}

void KnownKeyframes::add(const KeyframeView& keyframe) {
  const KeyframeScan& scan = keyframe.scans[keyframe.reference_scan];
  sessions_.front().keyframes.push_back(
      {keyframe.sequence, scan.scan_index,
       keyframe.T_odometry_keyframe.inverse() * scan.T_odometry_sensor});
}

const KnownKeyframes::Known& KnownKeyframes::find(const KeyframeId& id) const {
  const auto& keyframes = sessions_.at(id.session).keyframes;
  const auto found = std::lower_bound(
      keyframes.begin(), keyframes.end(), id.keyframe,
      [](const Known& known, std::uint32_t sequence) { return known.sequence < sequence; });
  if (found == keyframes.end() || found->sequence != id.keyframe) {
    throw std::logic_error("loop search returned a keyframe that was not stored");
  }
  return *found;
}

LoopRecord KnownKeyframes::record(const LoopCandidate& candidate) const {
  const Known& query = sessions_.front().keyframes.back();
  const Known& match = find(candidate.match);
  LoopRecord record;
  record.query_session = sessions_.front().name;
  record.query_keyframe = query.sequence;
  record.query_scan = query.scan;
  record.match_session = sessions_.at(candidate.match.session).name;
  record.match_keyframe = match.sequence;
  record.match_scan = match.scan;
  record.confidence = static_cast<double>(candidate.confidence);
  record.accepted = candidate.accepted;
  record.reason = candidate.accepted ? "descriptor" : "confidence below threshold";
  record.T_match_query =
      match.T_keyframe_sensor.inverse() * candidate.T_match_query * query.T_keyframe_sensor;
  return record;
}

}  // namespace unimapper::apps
