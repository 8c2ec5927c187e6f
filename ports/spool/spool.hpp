// Spool: keyframes kept on the robot's disk until a base has them, in a ring of bounded size.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "ports/spool/files.hpp"
#include "ports/spool/index.hpp"
#include "ports/spool/segment_writer.hpp"
#include "unimapper/wire/sender_storage.hpp"

namespace unimapper::spool {

/// A spool cannot be opened as asked: another process uses the folder, or it is none. A full or
/// failing disk is no error.
class SpoolError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Smallest `SpoolOptions::bytes`.
inline constexpr std::uint64_t kSmallestSpoolBytes = 1000000;

/// Limits of a spool.
struct SpoolOptions {
  /// Disk space of all segments. Beyond it the oldest one goes whose keyframes are all
  /// acknowledged, or else the oldest.
  std::uint64_t bytes = 2000000000;
  std::uint64_t segment_bytes = 16000000;  ///< a file holds so much; at most a quarter of `bytes`
  /// Segments are removed when their newest keyframe is older by the robot's clock; 0: never. A
  /// clock that steps forward makes them old.
  std::chrono::seconds max_age{0};
  /// Memory for keyframes that wait to be written; beyond it the oldest is refused.
  std::uint64_t queue_bytes = 64000000;
  std::chrono::milliseconds retry_period{5000};  ///< between attempts on a disk that fails
  /// Acknowledgements wait so long for keyframes to be written along with.
  std::chrono::milliseconds acknowledge_period{1000};
  /// Told in words when the disk fails and when it works again, and what was found damaged. Called
  /// from the spool's thread and its constructor; may be empty.
  std::function<void(const std::string&)> report;
};

/// What a spool did and found so far.
struct SpoolCounters {
  std::uint64_t keyframes_added = 0;    ///< handed over
  std::uint64_t keyframes_durable = 0;  ///< keyframes written, which survive a loss of power
  std::uint64_t keyframes_refused = 0;  ///< keyframes never written: the disk failed or was slow
  /// Keyframes on disk, removed without a base having them: the size or age limit, or the folder
  /// was removed.
  std::uint64_t keyframes_lost = 0;
  std::uint64_t keyframes_damaged = 0;  ///< not read back, or with a wrong checksum
  std::uint64_t keyframes_on_disk = 0;  ///< at present, of all sessions
  std::uint64_t bytes_on_disk = 0;      ///< at present
  std::uint64_t bytes_waiting = 0;     ///< at present, of keyframes on disk that no base has stored
  std::uint64_t segments_skipped = 0;  ///< of another version, or damaged at the front
  std::uint64_t faults = 0;            ///< stretches of other segments that are no record
  std::uint64_t commits = 0;           ///< times the disk was waited for
  std::uint64_t write_failures = 0;    ///< times the disk was waited for in vain
  bool failing = false;                ///< nothing can be written at present
};

/// Keeps encoded keyframes in segment files. A thread of its own writes them and a second one syncs
/// them, several at a time, while the first writes on; `add` takes a lock and copies. Survives the
/// end of the process at any moment: what was durable is found at the next start, and what was
/// written but not synced too, unless the power was lost. While the disk fails, keyframes stay in
/// memory as far as `queue_bytes` go, and writing is tried again every `retry_period`. Thread safe.
class Spool : public wire::SenderStorage {
 public:
  /// Opens or makes the folder and reads the heads of all records. `files`: only for tests. Throws
  /// SpoolError, std::invalid_argument for impossible limits.
  explicit Spool(std::filesystem::path folder, SpoolOptions options = {},
                 std::unique_ptr<Files> files = std::make_unique<Files>());
  /// Writes what waits, if the disk takes it.
  ~Spool() override;

  void add(const SessionInfo& info, const EncodedKeyframe& keyframe) override;
  [[nodiscard]] bool holds(const SessionId& session, std::uint32_t sequence) const override;
  std::optional<EncodedKeyframe> read(const SessionId& session, std::uint32_t sequence) override;
  void acknowledge(const SessionId& session, std::span<const std::uint32_t> sequences) override;
  void end(const SessionId& session) override;
  [[nodiscard]] std::vector<wire::EarlierSession> earlier_sessions() const override;

  /// Whether a keyframe is on disk and survives a loss of power.
  [[nodiscard]] bool is_durable(const SessionId& session, std::uint32_t sequence) const;
  /// Waits until all that was handed over is durable. False if the disk fails, or the time is over.
  bool flush(std::chrono::milliseconds timeout);
  /// What it did and found so far.
  [[nodiscard]] SpoolCounters counters() const;

 private:
  using Clock = std::chrono::steady_clock;

  struct Item {
    SessionInfo info;
    EncodedKeyframe keyframe;
  };
  using ItemPointer = std::shared_ptr<const Item>;
  struct Placed {
    ItemPointer item;
    Place place;
    std::int64_t written_s = 0;
  };
  /// What is to be written at once.
  struct Batch {
    std::vector<ItemPointer> keyframes;
    std::map<SessionId, SequenceSet> acknowledged;
    std::set<SessionId> ended;
  };

  void run();
  [[nodiscard]] bool has_work(Clock::time_point now) const;
  [[nodiscard]] Batch take_batch();
  void put_back(Batch batch);
  bool write(const Batch& batch);
  bool write_keyframe(const ItemPointer& item);
  bool write_acknowledgements(const std::map<SessionId, SequenceSet>& acknowledged,
                              const std::set<SessionId>& ended);
  bool begin_segment(std::uint64_t keyframe_bytes);
  void abandon_segment();
  void take_off_queue(const ItemPointer& item);
  bool sync_placed();
  bool sync_beside_writing();
  bool write_until_synced(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] bool next_fits_segment() const;
  [[nodiscard]] bool is_placed(const ItemPointer& item) const;
  void index_synced(std::size_t count);
  void run_syncs(const std::stop_token& stop);
  void make_room(std::uint64_t bytes);
  bool make_room_on_full_disk();
  void remove_segment(std::uint64_t number);
  void prepare();
  void succeed();
  void fail(int error);
  void report(const std::string& text) const;

  const std::filesystem::path folder_;
  const SpoolOptions options_;
  const std::unique_ptr<Files> files_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  std::condition_variable_any sync_asked_;
  Index index_;
  std::deque<ItemPointer> queue_;
  std::uint64_t queue_bytes_ = 0;
  std::size_t writing_ = 0;  ///< the first so many of the queue are being written
  std::map<SessionId, SequenceSet> acknowledged_;  ///< not written yet
  std::set<SessionId> ended_;                      ///< not written yet
  std::set<SessionId> own_;                        ///< sessions added since the start
  SpoolCounters counters_;
  Clock::time_point acknowledge_at_ = Clock::time_point::max();
  Clock::time_point retry_at_;
  std::optional<std::uint64_t> sync_bytes_;  ///< of the segment, while they are being synced
  int sync_error_ = 0;                       ///< of the last sync; 0: none
  bool busy_ = false;
  bool stopping_ = false;

  // The thread's own, and the constructor's.
  FolderLock lock_;
  SegmentWriter writer_;
  std::vector<Placed> placed_;  ///< written to the segment, not synced
  bool prepared_ = false;
  std::thread thread_;
  std::jthread syncing_thread_;  ///< runs `writer_.sync` for the other one
};

}  // namespace unimapper::spool
