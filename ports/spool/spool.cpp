#include "ports/spool/spool.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace unimapper::spool {

namespace {

std::string reason(int error) { return std::generic_category().message(error); }

/// A wrong path, as opposed to a disk that may recover.
bool is_mistake(int error) {
  return error == ENOTDIR || error == EACCES || error == EPERM || error == ELOOP ||
         error == ENAMETOOLONG || error == EEXIST;
}

}  // namespace

Spool::Spool(std::filesystem::path folder, SpoolOptions options, std::unique_ptr<Files> files)
    : folder_(std::move(folder)),
      options_(std::move(options)),
      files_(std::move(files)),
      retry_at_(Clock::now()),
      writer_(*files_, folder_) {
  if (options_.segment_bytes == 0 || options_.bytes < kSmallestSpoolBytes ||
      options_.segment_bytes > options_.bytes / 4) {
    throw std::invalid_argument("a spool needs 1 MB at least, and room for four segments");
  }
  try {
    prepare();
  } catch (const std::system_error& error) {
    const int number = error.code().value();
    if (number == EWOULDBLOCK) {
      throw SpoolError(folder_.string() + ": another process uses this spool");
    }
    if (is_mistake(number)) throw SpoolError(folder_.string() + ": " + reason(number));
    fail(number);
  }
  syncing_thread_ = std::jthread([this](const std::stop_token& stop) { run_syncs(stop); });
  thread_ = std::thread([this] { run(); });
}

Spool::~Spool() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Spool::add(const SessionInfo& info, const EncodedKeyframe& keyframe) {
  auto item = std::make_shared<const Item>(Item{info, keyframe});
  {
    const std::lock_guard lock(mutex_);
    ++counters_.keyframes_added;
    own_.insert(info.id);
    if (keyframe.bytes.size() + kSegmentOverheadBytes > options_.bytes) {
      ++counters_.keyframes_refused;
      return;
    }
    queue_bytes_ += keyframe.bytes.size();
    queue_.push_back(std::move(item));
    // What is being written stays: it is about to make room itself.
    while (queue_bytes_ > options_.queue_bytes && queue_.size() > writing_) {
      const auto oldest = queue_.begin() + static_cast<std::ptrdiff_t>(writing_);
      queue_bytes_ -= (*oldest)->keyframe.bytes.size();
      queue_.erase(oldest);
      ++counters_.keyframes_refused;
    }
  }
  wake_.notify_all();
}

bool Spool::holds(const SessionId& session, std::uint32_t sequence) const {
  const std::lock_guard lock(mutex_);
  if (index_.find(session, sequence)) return true;
  return std::any_of(queue_.begin(), queue_.end(), [&](const ItemPointer& item) {
    return item->info.id == session && item->keyframe.sequence == sequence;
  });
}

std::optional<EncodedKeyframe> Spool::read(const SessionId& session, std::uint32_t sequence) {
  std::unique_lock lock(mutex_);
  for (const ItemPointer& item : queue_) {
    if (item->info.id == session && item->keyframe.sequence == sequence) return item->keyframe;
  }
  const auto place = index_.find(session, sequence);
  if (!place) return std::nullopt;
  // Open, the file stays readable even if it is removed meanwhile.
  const InputFile file(folder_ / segment_name(place->segment));
  lock.unlock();
  auto bytes = read_data(file, place->offset, place->bytes, place->crc32);
  if (bytes) return EncodedKeyframe{session, sequence, place->stamp_ns, std::move(*bytes)};
  lock.lock();
  ++counters_.keyframes_damaged;
  index_.remove_keyframe(session, sequence);
  return std::nullopt;
}

void Spool::acknowledge(const SessionId& session, std::span<const std::uint32_t> sequences) {
  if (sequences.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    for (const std::uint32_t sequence : sequences) {
      const wire::SequenceRange range{sequence, sequence + 1ULL};
      index_.acknowledge(session, range);
      acknowledged_[session].insert(range);
    }
    acknowledge_at_ = std::min(acknowledge_at_, Clock::now() + options_.acknowledge_period);
  }
  wake_.notify_all();
}

void Spool::end(const SessionId& session) {
  {
    const std::lock_guard lock(mutex_);
    index_.end(session);
    ended_.insert(session);
    acknowledge_at_ = Clock::now();
  }
  wake_.notify_all();
}

bool Spool::is_durable(const SessionId& session, std::uint32_t sequence) const {
  const std::lock_guard lock(mutex_);
  return index_.find(session, sequence).has_value();
}

std::vector<wire::EarlierSession> Spool::earlier_sessions() const {
  const std::lock_guard lock(mutex_);
  std::vector<wire::EarlierSession> earlier;
  for (const auto& [id, session] : index_.sessions()) {
    if (own_.contains(id) || session.on_disk.empty()) continue;
    wire::EarlierSession entry;
    entry.info = session.info;
    entry.keyframes = session.on_disk.rbegin()->first + 1ULL;
    entry.acknowledged = session.acknowledged.count();
    entry.newest_stamp_ns = session.on_disk.rbegin()->second.stamp_ns;
    entry.ended = session.ended;
    const auto runs = session.acknowledged.ranges();
    if (!runs.empty()) entry.keyframes = std::max(entry.keyframes, runs.back().end);
    for (const auto& [sequence, place] : session.on_disk) {
      if (!session.acknowledged.contains(sequence)) {
        entry.waiting.push_back({sequence, place.bytes});
      }
    }
    earlier.push_back(std::move(entry));
  }
  return earlier;
}

bool Spool::flush(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (!acknowledged_.empty() || !ended_.empty()) acknowledge_at_ = Clock::now();
  wake_.notify_all();
  const auto is_idle = [this] {
    return !busy_ && queue_.empty() && acknowledged_.empty() && ended_.empty();
  };
  // What is being tried may be what ends the failure.
  idle_.wait_for(lock, timeout, [&] { return is_idle() || (counters_.failing && !busy_); });
  return is_idle();
}

SpoolCounters Spool::counters() const {
  const std::lock_guard lock(mutex_);
  SpoolCounters counters = counters_;
  counters.keyframes_on_disk = index_.keyframes();
  counters.bytes_on_disk = index_.bytes();
  counters.bytes_waiting = index_.waiting_bytes();
  return counters;
}

bool Spool::has_work(Clock::time_point now) const {
  return !queue_.empty() || now >= acknowledge_at_;
}

void Spool::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    const Clock::time_point now = Clock::now();
    if (!stopping_ && (now < retry_at_ || !has_work(now))) {
      const Clock::time_point until = now < retry_at_ ? retry_at_ : acknowledge_at_;
      // No predicate: what wakes may have set a time before `until`. Some clocks of condition
      // variables cannot count to the end of time.
      wake_.wait_until(lock, std::min(until, now + std::chrono::hours(1)));
      continue;
    }
    Batch batch = take_batch();
    const bool has_any =
        !batch.keyframes.empty() || !batch.acknowledged.empty() || !batch.ended.empty();
    const bool last = stopping_;
    if (has_any) {
      busy_ = true;
      lock.unlock();
      const bool written = write(batch);
      lock.lock();
      busy_ = false;
      writing_ = 0;
      if (!written) put_back(std::move(batch));
      idle_.notify_all();
    }
    if (last) return;
  }
}

Spool::Batch Spool::take_batch() {
  acknowledge_at_ = Clock::time_point::max();
  writing_ = queue_.size();
  return {
      {queue_.begin(), queue_.end()}, std::exchange(acknowledged_, {}), std::exchange(ended_, {})};
}

/// Keyframes are still in the queue.
void Spool::put_back(Batch batch) {
  for (const auto& [session, sequences] : batch.acknowledged) {
    for (const auto& range : sequences.ranges()) acknowledged_[session].insert(range);
  }
  ended_.merge(batch.ended);
  if (!acknowledged_.empty() || !ended_.empty()) acknowledge_at_ = Clock::now();
}

/// Makes, locks and reads the folder. Throws std::system_error.
void Spool::prepare() {
  if (!files_->make_folder(folder_) || !lock_.acquire(folder_ / "lock")) {
    throw std::system_error(errno, std::generic_category());
  }
  Index found;
  const Found result = found.read(folder_);
  {
    const std::lock_guard lock(mutex_);
    found.take_acknowledgements(index_);
    for (const auto& [id, session] : index_.sessions()) {
      for (const auto& [sequence, place] : session.on_disk) {
        const bool gone = !found.find(id, sequence) && !session.acknowledged.contains(sequence);
        counters_.keyframes_lost += gone ? 1 : 0;
      }
    }
    index_ = std::move(found);
    counters_.segments_skipped = result.segments_skipped;
    counters_.faults = result.faults;
  }
  prepared_ = true;
  if (result.segments_skipped + result.faults == 0) return;
  report(folder_.string() + ": " + std::to_string(result.segments_skipped) +
         " files are no segments of this version and were left alone; " +
         std::to_string(result.faults) + " torn or damaged stretches were passed over");
}

void Spool::succeed() {
  bool recovered = false;
  {
    const std::lock_guard lock(mutex_);
    recovered = std::exchange(counters_.failing, false);
  }
  if (recovered) report(folder_.string() + ": writing works again");
}

void Spool::fail(int error) {
  // Gone with its folder: a new one has to be made, locked and read.
  if (error == ENOENT) prepared_ = false;
  bool failed_before = false;
  {
    const std::lock_guard lock(mutex_);
    ++counters_.write_failures;
    failed_before = std::exchange(counters_.failing, true);
    retry_at_ = Clock::now() + options_.retry_period;
  }
  if (failed_before) return;
  report(folder_.string() + ": cannot be written (" + reason(error) +
         "); keyframes are kept in memory only");
}

void Spool::report(const std::string& text) const {
  if (options_.report) options_.report(text);
}

}  // namespace unimapper::spool
