#include "unimapper/wire/receiver.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::wire {

namespace {

/// Damaged sequence numbers remembered per session; forgers can make up any number of them.
constexpr std::size_t kMaxDamagedKept = 100000;

/// Messages of a running session that take its end back: one may have been overtaken.
constexpr std::uint32_t kSignsOfLife = 2;

std::string name_of_numbers(const SessionId& id) {
  return "robot" + std::to_string(id.robot) + "_boot" + to_text(id.boot);
}

std::uint64_t memory_of(const KeyframeRecord& record) {
  std::uint64_t image_bytes = 0;
  for (const CodedImage& image : record.images) image_bytes += sizeof image + image.code.size();
  return sizeof record + record.scans.size() * sizeof(KeyframeScan) +
         (record.static_cells.size() + record.dynamic_cells.size()) * sizeof(FineCell) +
         record.keypoints.size() * sizeof(Keypoint) + record.planes.size() * sizeof(PlanePatch) +
         image_bytes;
}

bool is_same(const SessionInfo& a, const SessionInfo& b) {
  return a.name == b.name && a.sensor == b.sensor;
}

}  // namespace

Receiver::Receiver(const ReceiverLimits& limits) : limits_(limits), reassembly_(limits) {}

void Receiver::count_malformed() {
  ++counters_.messages;
  ++counters_.malformed;
}

Receiver::Session* Receiver::session(const SessionId& id) {
  if (!sessions_.contains(id) && sessions_.size() >= limits_.max_sessions &&
      !forget_empty_session()) {
    ++counters_.refused;
    return nullptr;
  }
  Session& state = sessions_[id];
  state.last_heard = ++clock_;
  state.answered = false;
  return &state;
}

/// Anybody can announce sessions; only keyframes show that there is a robot behind one. A real
/// one comes back with its next message.
bool Receiver::forget_empty_session() {
  auto oldest = sessions_.end();
  for (auto entry = sessions_.begin(); entry != sessions_.end(); ++entry) {
    if (!entry->second.keyframes.empty()) continue;
    const bool older =
        oldest == sessions_.end() || entry->second.last_heard < oldest->second.last_heard;
    if (older) oldest = entry;
  }
  if (oldest == sessions_.end()) return false;
  sessions_.erase(oldest);
  ++counters_.refused;
  return true;
}

void Receiver::receive(const SessionMessage& message) {
  ++counters_.messages;
  Session* state = session(message.info.id);
  if (state == nullptr) return;
  if (!state->info) {
    state->info = message.info;
  } else if (!is_same(*state->info, message.info)) {
    ++counters_.contradictory;
    return;
  }
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
}

void Receiver::receive(HealthMessage&& message) {
  ++counters_.messages;
  if (Session* state = session(message.session)) state->health = std::move(message);
}

void Receiver::receive(ChunkMessage&& piece) {
  ++counters_.messages;
  const SessionId id = piece.session;
  const std::uint32_t sequence = piece.sequence;
  Session* state = session(id);
  if (state == nullptr) return;
  // A keyframe that never becomes whole is missed all the same.
  state->highest_seen = std::max<std::uint64_t>(state->highest_seen, sequence + 1ULL);
  state->announced = std::max(state->announced, state->highest_seen);
  if (state->keyframes.contains(sequence)) {
    ++counters_.pieces_duplicate;
    return;
  }
  Reassembly::Result result = reassembly_.add(std::move(piece), !state->keyframes.empty());
  switch (result.outcome) {
    case Reassembly::Outcome::kWaiting:
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
    case Reassembly::Outcome::kComplete: {
      DecodedKeyframe decoded = decode_keyframe(result.payload);
      const bool honest =
          decoded.record && decoded.record->session == id && decoded.record->sequence == sequence;
      if (honest) {
        keep(*state, std::move(*decoded.record));
      } else {
        mark_damaged(*state, sequence);
      }
      break;
    }
  }
}

void Receiver::keep(Session& state, KeyframeRecord&& record) {
  const std::uint64_t bytes = memory_of(record);
  if (bytes > limits_.max_stored_bytes - stored_bytes_) {
    ++counters_.refused;
    return;
  }
  stored_bytes_ += bytes;
  reassembly_.forget(record.session, record.sequence);
  const std::uint32_t sequence = record.sequence;
  state.damaged.erase(sequence);
  state.stored.insert(sequence);
  state.keyframes.emplace(sequence, std::move(record));
  ++counters_.keyframes;
}

void Receiver::mark_damaged(Session& state, std::uint32_t sequence) {
  ++counters_.keyframes_damaged;
  if (state.damaged.size() < kMaxDamagedKept) state.damaged.insert(sequence);
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
    one.info = state.info.value_or(SessionInfo{id, name_of_numbers(id), {}});
    one.ended = state.ended;
    one.announced = state.announced;
    one.received = state.keyframes.size();
    one.whole = state.ended && one.received + state.dropped_by_sender >= state.announced;
    one.health = state.health;
    all.push_back(std::move(one));
  }
  return all;
}

std::vector<StoredMessage> Receiver::take_stored() {
  std::vector<StoredMessage> messages;
  for (auto& [id, state] : sessions_) {
    if (state.answered) continue;
    state.answered = true;
    StoredMessage& message = messages.emplace_back();
    message.session = id;
    message.ended = state.ended;
    message.incomplete = reassembly_.incomplete(id);
    state.stored.describe(message);
  }
  return messages;
}

std::vector<SessionData> Receiver::take_sessions() {
  std::vector<SessionData> sessions;
  for (auto& [id, state] : sessions_) {
    SessionData data;
    data.info = state.info.value_or(SessionInfo{id, name_of_numbers(id), {}});
    data.complete = state.ended;
    data.keyframes_damaged = state.damaged.size();
    const std::uint64_t accounted = state.keyframes.size() + state.damaged.size();
    data.keyframes_missing = state.announced - std::min(state.announced, accounted);
    data.keyframes.reserve(state.keyframes.size());
    for (auto& [sequence, record] : state.keyframes) data.keyframes.push_back(std::move(record));
    sessions.push_back(std::move(data));
  }
  sort_and_name(sessions);
  sessions_.clear();
  stored_bytes_ = 0;
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
