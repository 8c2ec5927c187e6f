#include "src/apps/base/live_localisation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "src/apps/base/due_map_poses.hpp"
#include "src/apps/base/map_pose_message.hpp"
#include "src/apps/map_pose_text.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::apps {

namespace {

constexpr std::size_t kReplayedKeyframes = merge::Localiser::kRememberedKeyframes;
/// Before other sessions have their turn.
constexpr std::size_t kKeyframesAtOnce = 4;
constexpr std::chrono::seconds kMapInterval{10};
constexpr std::chrono::seconds kGivesWayAfter{30};

std::string robot_text(const SessionId& id, const std::string& name) {
  return name + " (robot " + std::to_string(id.robot) + ")";
}

}  // namespace

LiveLocalisation::LiveLocalisation(LiveLocalisationOptions options)
    : options_(std::move(options)), store_(options_.store) {
  for (const store::SessionExtent& session : store_.sessions()) {
    seen_[session.row] = session.newest;
  }
}

bool LiveLocalisation::advance(Clock::time_point now) {
  if (!next_look_) look_for_map(now);
  if (store_.has_changed() || has_more_) {
    has_more_ = true;  // also if this fails
    has_more_ = take_all(now);
  }
  forget_over(now);
  return has_more_;
}

void LiveLocalisation::look_for_map(Clock::time_point now) {
  if (map_ || (next_look_ && now < *next_look_)) return;
  std::string trouble;
  try {
    map_ = options_.read_map();
  } catch (const std::exception& error) {
    trouble = std::string("robots are not localised: ") + error.what();
  }
  if (map_ && (!next_look_ || !trouble_.empty())) {
    options_.report("robots are localised in the map of epoch " + std::to_string(map_->epoch));
  }
  if (trouble != trouble_ && !trouble.empty()) options_.report("warning: " + trouble);
  trouble_ = std::move(trouble);
  next_look_ = map_ ? now : now + kMapInterval;
}

bool LiveLocalisation::take_all(Clock::time_point now) {
  bool has_more = false;
  for (const store::SessionExtent& session : store_.sessions()) {
    Followed* const of_session = followed(session, now);
    if (of_session == nullptr) continue;
    of_session->ended = session.ended;
    has_more = take_some(session, *of_session, now) || has_more;
  }
  return has_more;
}

LiveLocalisation::Followed* LiveLocalisation::followed(const store::SessionExtent& session,
                                                       Clock::time_point now) {
  if (!live_.contains(session.row)) {
    const auto [seen, is_fresh] = seen_.try_emplace(session.row, -1);
    if (session.newest <= seen->second) return nullptr;
    seen->second = session.newest;
    start(session, is_fresh, now);
  }
  const auto live = live_.find(session.row);
  return live == live_.end() ? nullptr : &live->second;
}

void LiveLocalisation::start(const store::SessionExtent& session, bool is_fresh,
                             Clock::time_point now) {
  if (live_.size() >= options_.max_sessions && !make_room(now)) {
    if (counters_.sessions_refused++ > 0) return;
    options_.report("warning: " + robot_text(session.id, session.name) +
                    " is not localised: " + std::to_string(options_.max_sessions) +
                    " sessions are, which is as many as may be at once; others may follow unsaid");
    return;
  }
  look_for_map(now);
  if (!map_) return;
  StoredMap map = std::move(*map_);
  map_.reset();
  try {
    Followed followed{session.id, session.name,
                      merge::Localiser(std::move(map.sessions), map.posed, map.config)};
    followed.epoch = map.epoch;
    followed.next = store_.start_of_newest(session, kReplayedKeyframes);
    followed.told_from = is_fresh ? 0 : session.newest;
    followed.before =
        session.keyframes - std::min<std::uint64_t>(session.keyframes, kReplayedKeyframes);
    followed.last_keyframe = now;
    live_.emplace(session.row, std::move(followed));
  } catch (const std::invalid_argument& error) {
    options_.report("warning: " + robot_text(session.id, session.name) +
                    " is not localised: " + error.what());
  }
}

/// The session that has been without a keyframe for longest gives way.
bool LiveLocalisation::make_room(Clock::time_point now) {
  const auto quietest = std::min_element(
      live_.begin(), live_.end(),
      [](const auto& a, const auto& b) { return a.second.last_keyframe < b.second.last_keyframe; });
  if (quietest == live_.end() || now - quietest->second.last_keyframe < kGivesWayAfter) {
    return false;
  }
  forget(quietest);
  return true;
}

/// True if more wait.
bool LiveLocalisation::take_some(const store::SessionExtent& session, Followed& followed,
                                 Clock::time_point now) {
  const auto keyframes = store_.keyframes(session.row, followed.next, kKeyframesAtOnce);
  for (const store::StoredKeyframe& keyframe : keyframes) {
    take(keyframe, followed);
    followed.next = std::int64_t{keyframe.sequence} + 1;
    ++followed.taken;
    followed.last_keyframe = now;
  }
  if (keyframes.size() == kKeyframesAtOnce) return true;
  // All the others that were stored by then lie before those that were taken.
  const std::uint64_t known = followed.before + followed.taken;
  if (session.keyframes > known) {
    counters_.late += session.keyframes - known;
    followed.before += session.keyframes - known;
  }
  return false;
}

void LiveLocalisation::take(const store::StoredKeyframe& keyframe, Followed& followed) {
  if (followed.is_broken) return;
  wire::DecodedKeyframe decoded;
  if (keyframe.is_sound) decoded = wire::decode_keyframe(keyframe.bytes);
  if (!decoded.record) return leave_out(keyframe.sequence, followed, "it is damaged in the store");
  const std::int64_t stamp_ns = decoded.record->scans[decoded.record->reference_scan].stamp_ns;
  merge::MapPose at;
  try {
    at = followed.localiser.add(std::move(*decoded.record));
  } catch (const std::invalid_argument& error) {
    return leave_out(keyframe.sequence, followed, error.what());
  } catch (const std::exception& error) {
    // What it knows may be half of it.
    followed.is_broken = true;
    return leave_out(keyframe.sequence, followed, error.what());
  }
  ++counters_.keyframes;
  if (keyframe.sequence < followed.told_from) return;
  const wire::MapPoseMessage message =
      map_pose_message(at, followed.epoch, followed.id, keyframe.sequence, stamp_ns);
  options_.answered(message);
  tell_state(message, at.path_m, followed);
}

void LiveLocalisation::leave_out(std::uint32_t sequence, const Followed& followed,
                                 const std::string& reason) {
  ++counters_.unusable;
  options_.report("warning: keyframe " + std::to_string(sequence) + " of " +
                  robot_text(followed.id, followed.name) +
                  " is left out of the localisation: " + reason);
}

void LiveLocalisation::tell_state(const wire::MapPoseMessage& message, double path_m,
                                  Followed& followed) {
  const auto state = static_cast<merge::LocalisationState>(message.state);
  if (state == followed.state) return;
  const bool is_lost = followed.state == merge::LocalisationState::kLocalised &&
                       state == merge::LocalisationState::kNotYet;
  followed.state = state;
  const std::string after = fmt::format(", after {:.1f} m", path_m);
  options_.report(robot_text(followed.id, followed.name) + " is " + (is_lost ? "lost, " : "") +
                  map_pose_text(message) + after);
}

void LiveLocalisation::forget_over(Clock::time_point now) {
  for (auto session = live_.begin(); session != live_.end();) {
    const auto next = std::next(session);
    const Followed& followed = session->second;
    const auto quiet = now - followed.last_keyframe;
    const bool is_over = followed.ended && quiet >= kToldAfterEnd;
    if (is_over || followed.is_broken || quiet >= kToldWithoutKeyframe) forget(session);
    session = next;
  }
}

void LiveLocalisation::forget(std::map<std::int64_t, Followed>::iterator session) {
  seen_[session->first] = session->second.next - 1;
  options_.forgotten(session->second.id);
  live_.erase(session);
}

}  // namespace unimapper::apps
