// Keyframes kept in memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::wire {

/// Keeps decoded keyframes in bounded memory; what it takes counts as stored at once. Summaries and
/// health stay with the receiver.
class MemoryStorage final : public KeyframeStorage {
 public:
  /// `max_bytes`: of decoded keyframes; those beyond are not taken.
  explicit MemoryStorage(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  Taken keep(ReceivedKeyframe&& keyframe) override;
  void keep(ReceivedSummary&& summary) override;
  void remove_summary(const KeyframeName& name) override;
  void keep(const SessionSummary& /*summary*/) override {}
  void keep(const HealthMessage& /*health*/) override {}
  Committed commit_due(std::int64_t /*now_ns*/) override { return {}; }
  Committed commit_all(std::int64_t /*now_ns*/) override { return {}; }
  /// Always empty: a receiver forgets no session that has keyframes here.
  std::optional<StoredSession> find(const SessionId& id) override;
  [[nodiscard]] std::vector<RobotUsage> usage() const override { return {}; }
  [[nodiscard]] bool accepts() const override { return true; }
  [[nodiscard]] bool is_durable() const override { return false; }

  /// Hands over a session's keyframes, and the summaries of those that never came, in ascending
  /// sequence; their memory is free again.
  void take(SessionData& session);

 private:
  using Records = std::map<SessionId, std::map<std::uint32_t, KeyframeRecord>>;

  std::vector<KeyframeRecord> take(Records& records, const SessionId& id);

  std::uint64_t max_bytes_;
  std::uint64_t bytes_ = 0;
  Records keyframes_;
  Records summaries_;
};

}  // namespace unimapper::wire
