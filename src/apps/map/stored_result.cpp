#include "src/apps/map/stored_result.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "src/apps/map/known_positions.hpp"
#include "unimapper/config/config_json.hpp"

namespace unimapper::apps {
namespace {

std::size_t index_of(std::int64_t session, const KeyframeRows& rows) {
  const std::optional<std::uint32_t> s = rows.index(session);
  if (!s) throw std::runtime_error("a session of the map is not in the store any more");
  return *s;
}

merge::PairOutcome from_stored(const store::PairResult& stored, const KeyframeRows& rows) {
  merge::PairOutcome pair;
  pair.match = index_of(stored.match, rows);
  pair.query = index_of(stored.query, rows);
  for (const auto state :
       {merge::PairState::kRefused, merge::PairState::kProvisional, merge::PairState::kConfirmed}) {
    if (stored.state == merge::state_name(state)) pair.state = state;
  }
  pair.reason = stored.reason;
  pair.loops = static_cast<std::size_t>(stored.loops);
  pair.distinct = static_cast<std::size_t>(stored.distinct);
  pair.competing = static_cast<std::size_t>(stored.competing);
  pair.T_match_session_query_session = stored.T_match_query;
  return pair;
}

}  // namespace

KeyframeRows::KeyframeRows(const std::vector<InputSession>& inputs,
                           const std::vector<SessionData>& sessions)
    : sessions_(sessions) {
  for (const InputSession& input : inputs) rows_.push_back(input.row);
}

std::optional<std::uint32_t> KeyframeRows::index(std::int64_t session) const {
  for (std::size_t s = 0; s < rows_.size(); ++s) {
    if (rows_[s] == session) return static_cast<std::uint32_t>(s);
  }
  return std::nullopt;
}

std::optional<KeyframeId> KeyframeRows::find(const store::KeyframeRow& keyframe) const {
  const std::optional<std::uint32_t> s = index(keyframe.session);
  if (!s) return std::nullopt;
  const auto& keyframes = sessions_[*s].keyframes;
  const auto found = std::lower_bound(
      keyframes.begin(), keyframes.end(), keyframe.sequence,
      [](const KeyframeRecord& k, std::uint32_t sequence) { return k.sequence < sequence; });
  if (found == keyframes.end() || found->sequence != keyframe.sequence) return std::nullopt;
  return KeyframeId{*s, found - keyframes.begin()};
}

store::LoopResult to_stored(const merge::LoopConstraint& loop, const KeyframeRows& rows) {
  store::LoopResult stored;
  stored.query = rows.row(loop.query);
  stored.match = rows.row(loop.match);
  stored.T_match_query = loop.T_match_query;
  stored.information = loop.information;
  stored.overlap = loop.overlap;
  stored.confidence = loop.confidence;
  stored.accepted = loop.decision.accepted;
  stored.by_person = loop.by_person;
  stored.reason = loop.decision.reason;
  return stored;
}

merge::LoopConstraint from_stored(const store::LoopResult& stored, KeyframeId query,
                                  KeyframeId match) {
  merge::LoopConstraint loop;
  loop.query = query;
  loop.match = match;
  loop.T_match_query = stored.T_match_query;
  loop.information = stored.information;
  loop.overlap = stored.overlap;
  loop.confidence = stored.confidence;
  loop.decision = {stored.accepted, stored.reason};
  loop.by_person = stored.by_person;
  return loop;
}

store::MapResult to_stored(const merge::MergeResult& result, const KeyframeRows& rows,
                           const merge::MergeConfig& config) {
  const std::vector<SessionData>& sessions = rows.sessions();
  store::MapResult stored;
  stored.parameters = dump_config(config);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const merge::MergedSession& merged = result.sessions[s];
    store::SessionResult& session = stored.sessions.emplace_back();
    session.session = rows.session(s);
    session.state = merge::status_name(merged.status);
    session.reason = merged.reason;
    session.T_map_session = merged.T_map_session;
    session.T_map_keyframe = merged.T_map_keyframe;
    for (const KeyframeRecord& keyframe : sessions[s].keyframes) {
      session.sequences.push_back(keyframe.sequence);
    }
  }
  for (const merge::LoopConstraint& loop : result.loops) {
    stored.loops.push_back(to_stored(loop, rows));
  }
  for (const merge::PairOutcome& pair : result.pairs) {
    stored.pairs.push_back({rows.session(pair.match), rows.session(pair.query),
                            merge::state_name(pair.state), pair.reason, pair.loops, pair.distinct,
                            pair.competing, pair.T_match_session_query_session});
  }
  keep_positions(result, rows, stored);
  return stored;
}

merge::MergeResult posed_result(const store::MapResult& stored, const KeyframeRows& rows) {
  merge::MergeResult posed;
  posed.sessions.resize(rows.sessions().size());
  for (const store::SessionResult& session : stored.sessions) {
    const std::size_t s = index_of(session.session, rows);
    merge::MergedSession& merged = posed.sessions[s];
    for (const auto status :
         {merge::SessionStatus::kCentral, merge::SessionStatus::kMerged,
          merge::SessionStatus::kProvisional, merge::SessionStatus::kUnconnected}) {
      if (session.state == merge::status_name(status)) merged.status = status;
    }
    if (merged.status == merge::SessionStatus::kCentral) posed.central_session = s;
    merged.reason = session.reason;
    merged.T_map_session = session.T_map_session;
    merged.T_map_keyframe = session.T_map_keyframe;
  }
  for (const store::LoopResult& loop : stored.loops) {
    const auto query = rows.find(loop.query);
    const auto match = rows.find(loop.match);
    if (!query || !match) throw std::runtime_error("a keyframe of the map is damaged in the store");
    posed.loops.push_back(from_stored(loop, *query, *match));
  }
  for (const store::PairResult& pair : stored.pairs) {
    posed.pairs.push_back(from_stored(pair, rows));
  }
  restore_positions(stored, rows, posed);
  return posed;
}

}  // namespace unimapper::apps
