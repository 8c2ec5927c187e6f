// Import of recorded sessions into a store, within a transaction of the caller's.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::store {

/// What became of one session.
struct ImportedSession {
  std::int64_t row = 0;         ///< its row in the store
  std::string name;             ///< as announced
  std::uint64_t keyframes = 0;  ///< new in the store
  std::uint64_t repeated = 0;   ///< in the store already, the same bytes
  std::uint64_t replaced = 0;   ///< in the store already, damaged there
  std::uint64_t differing = 0;  ///< in the store already, other bytes: another run of that identity
};

/// Writes what a receiver hands over at once; the caller's transaction makes it durable or takes it
/// back. What goes wrong is in `trouble()`, and then nothing must be committed.
class SessionImport final : public wire::KeyframeStorage {
 public:
  explicit SessionImport(Database& database);

  Taken keep(wire::ReceivedKeyframe&& keyframe) override;
  void keep(wire::ReceivedSummary&& summary) override;
  void remove_summary(const wire::KeyframeName& name) override;
  void keep(const wire::SessionSummary& summary) override;
  void keep(const wire::HealthMessage&) override {}
  wire::Committed commit_due(std::int64_t) override { return {}; }
  wire::Committed commit_all(std::int64_t) override;
  std::optional<wire::StoredSession> find(const SessionId& id) override;
  [[nodiscard]] std::vector<wire::RobotUsage> usage() const override { return {}; }
  [[nodiscard]] bool accepts() const override { return true; }
  [[nodiscard]] bool is_durable() const override { return true; }

  /// The first error, empty if there was none.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// What became of every session that has a keyframe or a summary.
  [[nodiscard]] std::map<SessionId, ImportedSession> sessions() const { return sessions_; }
  /// Names a session, if it had no keyframe in the store before.
  void name(const SessionId& id, const std::string& name);

 private:
  template <typename Step>
  void attempt(const Step& step);
  void write(const wire::ReceivedKeyframe& keyframe);
  void write(const wire::ReceivedSummary& summary);
  void write(const wire::SessionSummary& summary);
  void compare(const wire::ReceivedKeyframe& keyframe, std::int64_t checksum,
               ImportedSession& session);
  ImportedSession& session_of(const SessionId& id);
  std::int64_t row_of(const SessionId& id);

  Database& database_;
  std::int64_t now_s_;
  std::map<SessionId, ImportedSession> sessions_;
  std::map<wire::KeyframeName, wire::ReceivedSummary> summaries_;  ///< of keyframes not whole yet
  std::string trouble_;
};

}  // namespace unimapper::store
