// Durable store of sessions and keyframes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "ports/store/database.hpp"
#include "ports/store/health_history.hpp"
#include "ports/store/latencies.hpp"
#include "ports/store/store_file.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::store {

/// When a store commits, and what it may hold.
struct StoreOptions {
  std::size_t batch_keyframes = 32;                ///< keyframes that wait when a commit is due
  std::uint64_t batch_bytes = 8U << 20U;           ///< bytes that wait when a commit is due
  std::int64_t batch_interval_ns = 100'000'000;    ///< longest wait for a commit
  std::int64_t retry_interval_ns = 1'000'000'000;  ///< wait after a commit that failed
  std::uint64_t max_waiting_bytes = 64U << 20U;    ///< beyond it no keyframe is taken
  std::uint64_t max_summary_bytes = 4U << 20U;     ///< beyond it no summary is taken
  std::uint64_t max_bytes = 0;                     ///< size of the database; 0: unlimited
};

/// What a store has done since it was opened.
struct StoreCounters {
  std::uint64_t keyframes = 0;                 ///< stored
  std::uint64_t bytes = 0;                     ///< bytes of the keyframes stored, as encoded
  std::uint64_t repeated = 0;                  ///< stored already, left as they were
  std::uint64_t summaries = 0;                 ///< stored, of keyframes that were not whole then
  std::uint64_t commits = 0;                   ///< that succeeded
  std::uint64_t failed_commits = 0;            ///< rolled back, to be tried again
  std::chrono::nanoseconds longest_commit{0};  ///< longest time that one commit took
  /// How long each commit took, failed ones included; nothing is received meanwhile.
  Latencies commit_times;
  Latencies waits;  ///< of keyframes, from `keep` until committed
};

/// Keeps a receiver's keyframes in a SQLite database (write-ahead log, every commit on the disk
/// before it returns). What waits is committed together; a commit that fails stores nothing of it,
/// is reported by `trouble` and tried again. Memory: what waits, and a few megabytes. One process
/// may write to a store at a time. Not thread safe.
class KeyframeStore final : public wire::KeyframeStorage {
 public:
  /// Opens the store in `folder`, made if absent. Throws StoreError if it is none, or is locked,
  /// damaged or of a newer version.
  explicit KeyframeStore(const std::filesystem::path& folder, const StoreOptions& options = {});

  Taken keep(wire::ReceivedKeyframe&& keyframe) override;
  void keep(wire::ReceivedSummary&& summary) override;
  void remove_summary(const wire::KeyframeName& name) override;
  void keep(const wire::SessionSummary& summary) override;
  void keep(const wire::HealthMessage& health) override;
  wire::Committed commit_due(std::int64_t now_ns) override;
  wire::Committed commit_all(std::int64_t now_ns) override;
  std::optional<wire::StoredSession> find(const SessionId& id) override;
  [[nodiscard]] std::vector<wire::RobotUsage> usage() const override { return usage_; }
  [[nodiscard]] bool accepts() const override { return !is_failing_; }
  [[nodiscard]] bool is_durable() const override { return true; }

  /// The right to write that it holds as long as it lives, for other writers of this process.
  [[nodiscard]] const StoreLock& lock() const { return lock_; }
  /// What keeps the store from storing or reading, in words; empty since the last commit that
  /// succeeded.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// Keyframes that wait for a commit.
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }
  /// Totals since the store was opened.
  [[nodiscard]] const StoreCounters& counters() const { return counters_; }

 private:
  struct Waiting {
    wire::KeyframeName name;
    std::int64_t stamp_ns = 0;
    std::vector<std::uint8_t> bytes;
    std::chrono::steady_clock::time_point since{};  ///< when it was taken
  };

  void load_usage();
  wire::Committed commit(std::int64_t now_ns);
  void write_batch();
  void write_summary(const wire::SessionSummary& summary, std::int64_t now_s);
  void drop_summary(const wire::KeyframeName& name);
  /// Puts a keyframe or a summary into its table; false if that, or better, is stored already.
  bool insert(Statement& statement, const Waiting& waiting, std::int64_t now_s);
  /// False if the keyframe is stored already.
  bool write_keyframe(const Waiting& keyframe, std::int64_t now_s);
  [[nodiscard]] bool is_idle() const;

  StoreOptions options_;
  StoreLock lock_;
  Database database_;
  Statement insert_session_;
  Statement update_session_;
  Statement insert_keyframe_;
  Statement count_keyframe_;
  Statement find_session_;
  Statement find_sequences_;
  Statement insert_summary_;
  Statement remove_summary_;
  Statement find_summaries_;
  HealthHistory health_history_;
  std::vector<wire::RobotUsage> usage_;  ///< when the store was opened

  std::vector<Waiting> waiting_;
  std::map<wire::KeyframeName, Waiting> keyframe_summaries_;
  std::set<wire::KeyframeName> removed_keyframe_summaries_;
  std::uint64_t waiting_bytes_ = 0;  ///< of keyframes
  std::uint64_t keyframe_summary_bytes_ = 0;
  std::map<SessionId, wire::SessionSummary> session_summaries_;
  std::map<SessionId, wire::HealthMessage> health_;
  std::int64_t now_ns_ = 0;
  std::int64_t waits_since_ns_ = 0;
  std::int64_t retry_at_ns_ = 0;
  bool is_failing_ = false;
  std::string trouble_;
  StoreCounters counters_;
};

}  // namespace unimapper::store
