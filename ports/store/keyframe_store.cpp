#include "ports/store/keyframe_store.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "ports/store/session_key.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

/// Adds the time of its own life to the counters.
class CommitTimer {
 public:
  explicit CommitTimer(StoreCounters& counters) : counters_(counters) {}
  ~CommitTimer() {
    const std::chrono::nanoseconds took = std::chrono::steady_clock::now() - start_;
    counters_.longest_commit = std::max(counters_.longest_commit, took);
    counters_.commit_times.add(took);
  }
  CommitTimer(const CommitTimer&) = delete;
  CommitTimer& operator=(const CommitTimer&) = delete;

 private:
  StoreCounters& counters_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::int64_t wall_clock_s() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

}  // namespace

KeyframeStore::KeyframeStore(const std::filesystem::path& folder, const StoreOptions& options)
    : options_(options),
      lock_(folder, "a base"),
      database_(open_for_writing(folder)),
      insert_session_(database_,
                      "INSERT INTO sessions (identity, robot, first_stored_s) VALUES (?, ?, ?) "
                      "ON CONFLICT DO NOTHING"),
      update_session_(database_,
                      "UPDATE sessions SET ended = ?, announced = ?, dropped = ?, "
                      "name = coalesce(?, name), sensor = coalesce(?, sensor) WHERE identity = ?"),
      insert_keyframe_(database_,
                       "INSERT INTO keyframes (session, sequence, stamp_ns, crc32, bytes) "
                       "SELECT id, ?, ?, ?, ? FROM sessions WHERE identity = ? "
                       "ON CONFLICT DO NOTHING"),
      count_keyframe_(database_,
                      "UPDATE sessions SET keyframes = keyframes + 1, bytes = bytes + ? "
                      "WHERE identity = ?"),
      find_session_(database_,
                    "SELECT id, name, sensor, ended, announced, dropped FROM sessions "
                    "WHERE identity = ?"),
      find_sequences_(database_,
                      "SELECT sequence FROM keyframes WHERE session = ? ORDER BY sequence"),
      insert_summary_(database_,
                      "INSERT INTO summaries (session, sequence, stamp_ns, crc32, bytes) "
                      "SELECT id, ?1, ?2, ?3, ?4 FROM sessions WHERE identity = ?5 AND NOT EXISTS "
                      "(SELECT 1 FROM keyframes WHERE session = id AND sequence = ?1) "
                      "ON CONFLICT DO NOTHING"),
      remove_summary_(database_,
                      "DELETE FROM summaries WHERE sequence = ? AND "
                      "session = (SELECT id FROM sessions WHERE identity = ?)"),
      find_summaries_(database_,
                      "SELECT sequence, LENGTH(bytes), crc32 FROM summaries WHERE session = ?"),
      health_history_(database_) {
  if (options_.max_bytes > 0) {
    const std::uint64_t page = database_.number("PRAGMA page_size");
    database_.run("PRAGMA max_page_count = " + std::to_string(1 + options_.max_bytes / page));
  }
  load_usage();
}

void KeyframeStore::load_usage() {
  Statement rows(database_,
                 "SELECT robot, COUNT(*), SUM(bytes) + "
                 "SUM((SELECT COALESCE(SUM(LENGTH(m.bytes)), 0) FROM summaries m "
                 "WHERE m.session = s.id)) FROM sessions s GROUP BY robot");
  while (rows.step()) {
    usage_.push_back({static_cast<std::uint32_t>(rows.number(0)),
                      static_cast<std::uint64_t>(rows.number(1)),
                      static_cast<std::uint64_t>(rows.number(2))});
  }
}

bool KeyframeStore::is_idle() const {
  return waiting_.empty() && keyframe_summaries_.empty() && removed_keyframe_summaries_.empty() &&
         session_summaries_.empty() && health_.empty();
}

wire::KeyframeStorage::Taken KeyframeStore::keep(wire::ReceivedKeyframe&& keyframe) {
  const std::uint64_t bytes = keyframe.bytes.size();
  if (waiting_bytes_ + bytes > options_.max_waiting_bytes) return Taken::kNoRoom;
  if (is_idle()) waits_since_ns_ = now_ns_;
  const KeyframeRecord& record = keyframe.record;
  drop_summary({record.session, record.sequence});
  waiting_.push_back({{record.session, record.sequence},
                      record.scans.back().stamp_ns,
                      std::move(keyframe.bytes),
                      std::chrono::steady_clock::now()});
  waiting_bytes_ += bytes;
  return Taken::kWaiting;
}

void KeyframeStore::keep(wire::ReceivedSummary&& summary) {
  const std::uint64_t bytes = summary.bytes.size();
  if (keyframe_summary_bytes_ + bytes > options_.max_summary_bytes) return;
  if (is_idle()) waits_since_ns_ = now_ns_;
  const KeyframeRecord& record = summary.record;
  const wire::KeyframeName name{record.session, record.sequence};
  const Waiting waiting{name, record.scans.back().stamp_ns, std::move(summary.bytes), {}};
  if (keyframe_summaries_.try_emplace(name, waiting).second) keyframe_summary_bytes_ += bytes;
}

/// One that waits.
void KeyframeStore::drop_summary(const wire::KeyframeName& name) {
  const auto waiting = keyframe_summaries_.find(name);
  if (waiting == keyframe_summaries_.end()) return;
  keyframe_summary_bytes_ -= waiting->second.bytes.size();
  keyframe_summaries_.erase(waiting);
}

void KeyframeStore::remove_summary(const wire::KeyframeName& name) {
  if (is_idle()) waits_since_ns_ = now_ns_;
  drop_summary(name);
  removed_keyframe_summaries_.insert(name);
}

void KeyframeStore::keep(const wire::SessionSummary& summary) {
  if (is_idle()) waits_since_ns_ = now_ns_;
  session_summaries_[summary.id] = summary;
}

void KeyframeStore::keep(const wire::HealthMessage& health) {
  if (is_idle()) waits_since_ns_ = now_ns_;
  health_[health.session] = health;
}

wire::Committed KeyframeStore::commit_due(std::int64_t now_ns) {
  now_ns_ = now_ns;
  const bool is_due = waiting_.size() >= options_.batch_keyframes ||
                      waiting_bytes_ >= options_.batch_bytes ||
                      now_ns - waits_since_ns_ >= options_.batch_interval_ns;
  const bool may_try = !is_failing_ || now_ns >= retry_at_ns_;
  return is_due && may_try ? commit(now_ns) : wire::Committed();
}

wire::Committed KeyframeStore::commit_all(std::int64_t now_ns) { return commit(now_ns); }

wire::Committed KeyframeStore::commit(std::int64_t now_ns) {
  wire::Committed committed;
  if (is_idle()) return committed;
  const CommitTimer timer(counters_);
  try {
    write_batch();
  } catch (const StoreError& error) {
    is_failing_ = true;
    retry_at_ns_ = now_ns + options_.retry_interval_ns;
    trouble_ = error.what();
    ++counters_.failed_commits;
    return committed;
  }
  is_failing_ = false;
  trouble_.clear();
  ++counters_.commits;
  const auto now = std::chrono::steady_clock::now();
  for (const Waiting& keyframe : waiting_) {
    committed.keyframes.push_back(keyframe.name);
    counters_.waits.add(now - keyframe.since);
  }
  for (auto& [id, summary] : session_summaries_) committed.sessions.push_back(std::move(summary));
  waiting_.clear();
  keyframe_summaries_.clear();
  removed_keyframe_summaries_.clear();
  keyframe_summary_bytes_ = 0;
  waiting_bytes_ = 0;
  session_summaries_.clear();
  health_.clear();
  return committed;
}

/// One transaction; on failure nothing of it is stored.
void KeyframeStore::write_batch() {
  const std::int64_t now_s = wall_clock_s();
  StoreCounters counted = counters_;
  try {
    database_.run("BEGIN IMMEDIATE");
    for (const Waiting& keyframe : waiting_) {
      if (write_keyframe(keyframe, now_s)) {
        ++counted.keyframes;
        counted.bytes += keyframe.bytes.size();
      } else {
        ++counted.repeated;
      }
    }
    for (const wire::KeyframeName& name : removed_keyframe_summaries_) {
      remove_summary_.bind(std::int64_t{name.sequence}, to_key(name.session)).run();
    }
    for (const auto& [name, summary] : keyframe_summaries_) {
      counted.summaries += insert(insert_summary_, summary, now_s) ? 1 : 0;
    }
    for (const auto& [id, summary] : session_summaries_) write_summary(summary, now_s);
    for (const auto& [id, health] : health_) health_history_.keep(health, now_s);
    database_.run("COMMIT");
  } catch (const StoreError&) {
    if (database_.is_in_transaction()) {
      try {
        database_.run("ROLLBACK");
      } catch (const StoreError&) {
        // SQLite rolls back by itself before the next transaction.
      }
    }
    throw;
  }
  counters_ = counted;
}

bool KeyframeStore::insert(Statement& statement, const Waiting& waiting, std::int64_t now_s) {
  const std::vector<std::uint8_t> key = to_key(waiting.name.session);
  insert_session_.bind(key, std::int64_t{waiting.name.session.robot}, now_s).run();
  statement
      .bind(std::int64_t{waiting.name.sequence}, waiting.stamp_ns,
            std::int64_t{wire::crc32(waiting.bytes)}, waiting.bytes, key)
      .run();
  return database_.changes() > 0;
}

bool KeyframeStore::write_keyframe(const Waiting& keyframe, std::int64_t now_s) {
  if (!insert(insert_keyframe_, keyframe, now_s)) return false;
  const std::vector<std::uint8_t> key = to_key(keyframe.name.session);
  count_keyframe_.bind(to_integer(keyframe.bytes.size()), key).run();
  remove_summary_.bind(std::int64_t{keyframe.name.sequence}, key).run();
  return true;
}

void KeyframeStore::write_summary(const wire::SessionSummary& summary, std::int64_t now_s) {
  const std::vector<std::uint8_t> key = to_key(summary.id);
  insert_session_.bind(key, std::int64_t{summary.id.robot}, now_s).run();
  const std::int64_t ended = summary.ended ? 1 : 0;
  if (summary.info) {
    update_session_.bind(ended, to_integer(summary.announced),
                         to_integer(summary.dropped_by_sender), summary.info->name,
                         summary.info->sensor, key);
  } else {
    update_session_.bind(ended, to_integer(summary.announced),
                         to_integer(summary.dropped_by_sender), nullptr, nullptr, key);
  }
  update_session_.run();
}

std::optional<wire::StoredSession> KeyframeStore::find(const SessionId& id) {
  wire::StoredSession session;
  session.summary.id = id;
  const auto newer = session_summaries_.find(id);
  try {
    const std::vector<std::uint8_t> key = to_key(id);
    find_session_.bind(key);
    if (!find_session_.step()) return session;
    const std::int64_t row = find_session_.number(0);
    if (!find_session_.is_null(1)) {
      session.summary.info = SessionInfo{id, find_session_.text(1), find_session_.text(2)};
    }
    session.summary.ended = find_session_.number(3) != 0;
    session.summary.announced = static_cast<std::uint64_t>(find_session_.number(4));
    session.summary.dropped_by_sender = static_cast<std::uint64_t>(find_session_.number(5));
    find_session_.reset();
    find_sequences_.bind(row);
    while (find_sequences_.step()) {
      session.keyframes.insert(static_cast<std::uint32_t>(find_sequences_.number(0)));
    }
    find_summaries_.bind(row);
    while (find_summaries_.step()) {
      session.summaries[static_cast<std::uint32_t>(find_summaries_.number(0))] = {
          static_cast<std::uint32_t>(find_summaries_.number(1)),
          static_cast<std::uint32_t>(find_summaries_.number(2))};
    }
  } catch (const StoreError& error) {
    trouble_ = error.what();
    return std::nullopt;
  }
  if (newer != session_summaries_.end()) session.summary = newer->second;
  return session;
}

}  // namespace unimapper::store
