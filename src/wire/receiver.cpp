#include "unimapper/wire/receiver.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::wire {

namespace {

/// Messages of a running session that take its end back: one may have been overtaken.
constexpr std::uint32_t kSignsOfLife = 2;

bool is_same(const SessionInfo& a, const SessionInfo& b) {
  return a.name == b.name && a.sensor == b.sensor;
}

/// Whether the bytes say what their envelope says.
bool is_of(const DecodedKeyframe& decoded, const KeyframeName& name) {
  return decoded.record && decoded.record->session == name.session &&
         decoded.record->sequence == name.sequence;
}

/// Speaks of what is stored only: a robot told that the rest is missing would send it in vain.
void leave_out_missing(StoredMessage& message) {
  message.first = message.below;
  message.until = message.below;
  message.ranges.clear();
}

}  // namespace

std::string name_of(const SessionId& id) {
  return "robot" + std::to_string(id.robot) + "_boot" + to_text(id.boot);
}

Receiver::Receiver(const ReceiverLimits& limits)
    : limits_(limits),
      memory_(std::make_unique<MemoryStorage>(limits.max_stored_bytes)),
      storage_(memory_.get()),
      quotas_(limits.robot),
      reassembly_(limits) {}

Receiver::Receiver(const ReceiverLimits& limits, KeyframeStorage& storage)
    : limits_(limits), storage_(&storage), quotas_(limits.robot), reassembly_(limits) {
  quotas_.load(storage.usage());
}

void Receiver::advance(std::int64_t now_ns) {
  now_ns_ = now_ns;
  for (auto& [id, state] : sessions_) {
    if (!state.is_changed || !state.is_kept()) continue;
    storage_->keep({id, state.info, state.ended, state.announced, state.dropped_by_sender});
    state.is_changed = false;
  }
  take(storage_->commit_due(now_ns));
}

void Receiver::store_all() {
  advance(now_ns_);
  take(storage_->commit_all(now_ns_));
}

void Receiver::take(const Committed& committed) {
  for (const KeyframeName& name : committed.keyframes) {
    const auto entry = sessions_.find(name.session);
    if (entry == sessions_.end()) continue;
    entry->second.waiting.erase(name.sequence);
    entry->second.stored.insert(name.sequence);
    entry->second.answered = false;
    ++counters_.keyframes;
  }
  for (const SessionSummary& summary : committed.sessions) {
    const auto entry = sessions_.find(summary.id);
    if (entry == sessions_.end()) continue;
    entry->second.end_is_stored = summary.ended;
    entry->second.answered = false;
  }
}

void Receiver::count_malformed() {
  ++counters_.messages;
  ++counters_.malformed;
}

Receiver::Session* Receiver::session(const SessionId& id) {
  auto entry = sessions_.find(id);
  if (entry == sessions_.end()) {
    const std::optional<StoredSession> stored = storage_->find(id);
    if (!stored || (sessions_.size() >= limits_.max_sessions && !forget_session())) {
      ++counters_.refused;
      return nullptr;
    }
    entry = sessions_.emplace(id, Session()).first;
    Session& state = entry->second;
    state.quiet_since_ns = now_ns_;
    state.info = stored->summary.info;
    state.ended = stored->summary.ended;
    state.end_is_stored = stored->summary.ended;
    state.announced = stored->summary.announced;
    state.dropped_by_sender = stored->summary.dropped_by_sender;
    state.stored = stored->keyframes;
    for (const auto& [sequence, summary] : stored->summaries) {
      state.summaries[sequence] = {summary};
    }
    state.highest_seen = state.stored.end();
  }
  entry->second.last_heard = ++clock_;
  entry->second.answered = false;
  return &entry->second;
}

/// Anybody can announce sessions; only keyframes show that there is a robot behind one. A real
/// one comes back with its next message.
bool Receiver::forget_session() {
  auto victim = sessions_.end();
  const auto rank = [](const auto& entry) {
    return std::tuple(entry->second.has_keyframes(), entry->second.last_heard);
  };
  for (auto entry = sessions_.begin(); entry != sessions_.end(); ++entry) {
    const Session& state = entry->second;
    const bool is_whole_in_storage =
        storage_->is_durable() && state.waiting.empty() && !state.is_changed;
    if (state.has_keyframes() && !is_whole_in_storage) continue;
    if (victim == sessions_.end() || rank(entry) < rank(victim)) victim = entry;
  }
  if (victim == sessions_.end()) return false;
  if (!victim->second.has_keyframes()) ++counters_.refused;
  sessions_.erase(victim);
  return true;
}

void Receiver::receive(const SessionMessage& message) {
  ++counters_.messages;
  Session* state = session(message.info.id);
  if (state == nullptr) return;
  const auto known = [state] {
    return std::tuple(state->info.has_value(), state->ended, state->announced,
                      state->dropped_by_sender);
  };
  const auto before = known();
  if (!state->info) {
    state->info = message.info;
  } else if (!is_same(*state->info, message.info)) {
    ++counters_.contradictory;
    return;
  }
  if (message.state != SessionState::kEnded || !state->ended) state->quiet_since_ns = now_ns_;
  // Messages may overtake each other: what was once known stays known.
  state->ended = state->ended || message.state == SessionState::kEnded;
  state->announced = std::max(state->announced, message.keyframes);
  state->dropped_by_sender = std::max(state->dropped_by_sender, message.keyframes_dropped);
  if (message.state == SessionState::kEnded) {
    state->signs_of_life = 0;
  } else if (message.state == SessionState::kRunning && state->ended &&
             ++state->signs_of_life == kSignsOfLife) {
    // Somebody else said that it had ended, and perhaps how many keyframes there were.
    state->ended = false;
    state->signs_of_life = 0;
    state->announced = std::max(message.keyframes, state->highest_seen);
    state->dropped_by_sender = message.keyframes_dropped;
    ++counters_.contradictory;
  }
  state->is_changed = state->is_changed || known() != before;
}

void Receiver::receive(HealthMessage&& message) {
  ++counters_.messages;
  Session* state = session(message.session);
  if (state == nullptr) return;
  message.clock = state->clock;
  if (state->is_kept()) storage_->keep(message);
  state->health = std::move(message);
}

void Receiver::receive(ChunkMessage&& piece) {
  ++counters_.messages;
  const std::uint32_t sequence = piece.sequence;
  const KeyframeName name{piece.session, sequence};
  Session* state = session(name.session);
  if (state == nullptr) return;
  ++state->pieces;
  // A keyframe that never becomes whole is missed all the same.
  state->highest_seen = std::max<std::uint64_t>(state->highest_seen, sequence + 1ULL);
  if (state->announced < state->highest_seen) {
    state->announced = state->highest_seen;
    state->is_changed = true;
  }
  if (state->stored.contains(sequence) || state->waiting.contains(sequence)) {
    ++counters_.pieces_duplicate;
    return;
  }
  if (state->is_beyond_quota) return count_refused(*state);
  Reassembly::Result result = reassembly_.add(std::move(piece), state->has_keyframes());
  switch (result.outcome) {
    case Reassembly::Outcome::kWaiting:
      if (!result.summary.empty()) take_summary(*state, name, std::move(result.summary));
      break;
    case Reassembly::Outcome::kDuplicate:
      ++counters_.pieces_duplicate;
      break;
    case Reassembly::Outcome::kTooLarge:
      ++counters_.refused;
      break;
    case Reassembly::Outcome::kDamaged:
      mark_damaged(*state, sequence);
      break;
    case Reassembly::Outcome::kComplete:
      take_payload(*state, name, std::move(result.payload));
      break;
  }
}

void Receiver::take_payload(Session& state, const KeyframeName& name,
                            std::vector<std::uint8_t> payload) {
  // Its summary, which is counted, goes.
  const auto summary = state.summaries.find(name.sequence);
  const std::uint64_t counted = summary == state.summaries.end() ? 0 : summary->second.stored.bytes;
  const std::uint64_t more = payload.size() - std::min<std::uint64_t>(payload.size(), counted);
  if (!is_within_quota(state, name.session.robot, more)) return count_refused(state);
  // First, since decoding what somebody forged takes longer.
  if (check_ && !check_(name.session, payload)) return mark_damaged(state, name.sequence);
  DecodedKeyframe decoded = decode_keyframe(payload, limits_.max_record_bytes);
  if (!is_of(decoded, name)) return mark_damaged(state, name.sequence);
  keep(state, {std::move(payload), std::move(*decoded.record)});
}

/// What the base has of a keyframe until it is whole. Pieces may be forged where there are no keys,
/// and only the whole keyframe is signed: of two summaries that differ neither counts.
void Receiver::take_summary(Session& state, const KeyframeName& name,
                            std::vector<std::uint8_t> bytes) {
  const StoredSummary stored{static_cast<std::uint32_t>(bytes.size()), crc32(bytes)};
  const auto known = state.summaries.find(name.sequence);
  if (known != state.summaries.end()) {
    if (known->second.stored.crc32 == stored.crc32 || known->second.is_contradicted) return;
    known->second.is_contradicted = true;
    storage_->remove_summary(name);
    ++counters_.contradictory;
    return;
  }
  DecodedKeyframe decoded = decode_summary(bytes);
  // Whether the keyframe is any better shows when it is whole.
  if (!is_of(decoded, name) || state.summaries.size() >= limits_.max_damaged) return;
  const bool is_new_session = !state.is_kept();
  if (!is_within_quota(state, name.session.robot, bytes.size())) return count_refused(state);
  quotas_.take(name.session.robot, is_new_session, bytes.size(), now_ns_);
  state.summaries[name.sequence] = {stored};
  state.is_changed = state.is_changed || is_new_session;
  ++counters_.summaries;
  storage_->keep(ReceivedSummary{std::move(bytes), std::move(*decoded.record)});
  take(storage_->commit_due(now_ns_));
}

/// Its keyframe has come; the storage forgets it by itself.
void Receiver::forget_summary(Session& state, const KeyframeName& name) {
  const auto summary = state.summaries.find(name.sequence);
  if (summary == state.summaries.end()) return;
  quotas_.give_back(name.session.robot, summary->second.stored.bytes);
  state.summaries.erase(summary);
}

bool Receiver::is_within_quota(Session& state, std::uint32_t robot, std::uint64_t bytes) {
  const QuotaRefusal refusal = quotas_.check(robot, !state.is_kept(), bytes, now_ns_);
  state.is_beyond_quota = refusal == QuotaRefusal::kSessions || refusal == QuotaRefusal::kBytes;
  return refusal == QuotaRefusal::kNone;
}

void Receiver::keep(Session& state, ReceivedKeyframe&& keyframe) {
  const KeyframeName name{keyframe.record.session, keyframe.record.sequence};
  const std::uint64_t bytes = keyframe.bytes.size();
  const bool is_new_session = !state.is_kept();
  const KeyframeStorage::Taken taken = storage_->keep(std::move(keyframe));
  if (taken == KeyframeStorage::Taken::kNoRoom) return count_refused(state);
  forget_summary(state, name);
  state.quiet_since_ns = now_ns_;
  quotas_.take(name.session.robot, is_new_session, bytes, now_ns_);
  reassembly_.forget(name.session, name.sequence);
  state.damaged.erase(name.sequence);
  if (taken == KeyframeStorage::Taken::kStored) {
    state.stored.insert(name.sequence);
    ++counters_.keyframes;
    return;
  }
  state.waiting.insert(name.sequence);
  state.is_changed = state.is_changed || is_new_session;
  take(storage_->commit_due(now_ns_));
}

void Receiver::count_refused(Session& state) {
  ++counters_.refused;
  ++state.refused;
}

void Receiver::mark_damaged(Session& state, std::uint32_t sequence) {
  ++counters_.keyframes_damaged;
  if (state.damaged.size() < limits_.max_damaged) state.damaged.insert(sequence);
}

ReceiverCounters Receiver::counters() const {
  ReceiverCounters counters = counters_;
  counters.keyframes_abandoned = reassembly_.given_up();
  return counters;
}

std::vector<SessionProgress> Receiver::progress() const {
  std::vector<SessionProgress> all;
  for (const auto& [id, state] : sessions_) {
    SessionProgress one;
    one.info = state.info.value_or(SessionInfo{id, name_of(id), {}});
    one.ended = state.ended;
    one.quiet_since_ns = state.quiet_since_ns;
    one.announced = state.announced;
    one.dropped = state.dropped_by_sender;
    one.received = state.stored.count();
    one.waiting = state.waiting.size();
    one.summaries = static_cast<std::uint64_t>(
        std::count_if(state.summaries.begin(), state.summaries.end(),
                      [](const auto& entry) { return !entry.second.is_contradicted; }));
    one.damaged = state.damaged.size();
    one.refused = state.refused;
    one.whole = state.ended && one.received + state.dropped_by_sender >= state.announced;
    one.health = state.health;
    one.clock = state.clock;
    one.bytes_per_second = state.bytes_per_second;
    all.push_back(std::move(one));
  }
  return all;
}

std::vector<StoredMessage> Receiver::take_stored() {
  std::vector<StoredMessage> messages;
  const bool keeps_ends = storage_->is_durable();
  for (auto& [id, state] : sessions_) {
    if (state.answered) continue;
    state.answered = true;
    StoredMessage& message = messages.emplace_back();
    message.session = id;
    message.ended = state.ended && (state.end_is_stored || !keeps_ends || !state.has_keyframes());
    state.stored.describe(message);
    if (state.is_beyond_quota || !storage_->accepts()) {
      leave_out_missing(message);
    } else {
      message.incomplete = reassembly_.incomplete(id);
    }
  }
  return messages;
}

std::vector<SessionData> Receiver::take_sessions() {
  std::vector<SessionData> sessions;
  for (auto& [id, state] : sessions_) {
    SessionData data;
    data.info = state.info.value_or(SessionInfo{id, name_of(id), {}});
    data.complete = state.ended;
    data.keyframes_damaged = state.damaged.size();
    const std::uint64_t accounted = state.stored.count() + state.damaged.size();
    data.keyframes_missing = state.announced - std::min(state.announced, accounted);
    if (memory_ != nullptr) memory_->take(data);
    sessions.push_back(std::move(data));
  }
  sort_and_name(sessions);
  sessions_.clear();
  return sessions;
}

void sort_and_name(std::vector<SessionData>& sessions) {
  std::sort(sessions.begin(), sessions.end(), [](const auto& a, const auto& b) {
    return std::tie(a.info.name, a.info.id) < std::tie(b.info.name, b.info.id);
  });
  std::set<std::string> taken;
  for (SessionData& session : sessions) {
    const std::string name = session.info.name;
    for (int number = 2; !taken.insert(session.info.name).second; ++number) {
      session.info.name = name + "-" + std::to_string(number);
    }
  }
}

}  // namespace unimapper::wire
