// Syncing of a spool's segments, on a thread of its own while the other one writes on.
#include <algorithm>
#include <cerrno>

#include "ports/spool/spool.hpp"

namespace unimapper::spool {

/// Makes what was written durable, and only then says so.
bool Spool::sync_placed() {
  const bool ok = writer_.sync(writer_.bytes());
  const int error = errno;
  const std::lock_guard lock(mutex_);
  ++counters_.commits;
  errno = error;
  if (ok) index_synced(placed_.size());
  return ok;
}

/// Makes what was written durable while keyframes that come meanwhile are appended: what the kernel
/// has outlives the process. They stay in the queue and in `placed_` until the next sync.
bool Spool::sync_beside_writing() {
  const std::size_t count = placed_.size();
  std::unique_lock lock(mutex_);
  sync_bytes_ = writer_.bytes();
  sync_asked_.notify_one();
  const bool written = write_until_synced(lock);
  const int write_error = errno;
  ++counters_.commits;
  if (sync_error_ == 0) index_synced(count);
  errno = sync_error_ != 0 ? sync_error_ : write_error;
  return sync_error_ == 0 && written;
}

/// False, with `errno`, if a keyframe could not be written; the sync has ended in any case.
bool Spool::write_until_synced(std::unique_lock<std::mutex>& lock) {
  int error = 0;
  while (sync_bytes_) {
    if (error != 0 || !next_fits_segment()) {
      wake_.wait(lock, [&] { return !sync_bytes_ || (error == 0 && next_fits_segment()); });
      continue;
    }
    const ItemPointer item = queue_[writing_++];
    lock.unlock();
    if (!write_keyframe(item)) error = errno;
    lock.lock();
  }
  errno = error;
  return error == 0;
}

/// A new segment cannot begin before the one before is synced.
bool Spool::next_fits_segment() const {
  return queue_.size() > writing_ &&
         writer_.bytes() + queue_[writing_]->keyframe.bytes.size() <= options_.segment_bytes;
}

bool Spool::is_placed(const ItemPointer& item) const {
  return std::any_of(placed_.begin(), placed_.end(),
                     [&](const Placed& placed) { return placed.item == item; });
}

/// The first `count` of what was written are durable.
void Spool::index_synced(std::size_t count) {
  index_.set_bytes(writer_.number(), writer_.synced_bytes());
  const auto end = placed_.begin() + static_cast<std::ptrdiff_t>(count);
  for (auto placed = placed_.begin(); placed != end; ++placed) {
    index_.add(placed->item->info, placed->item->keyframe.sequence, placed->place,
               placed->written_s);
    ++counters_.keyframes_durable;
    take_off_queue(placed->item);
  }
  placed_.erase(placed_.begin(), end);
}

void Spool::run_syncs(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (sync_asked_.wait(lock, stop, [this] { return sync_bytes_.has_value(); })) {
    const std::uint64_t bytes = *sync_bytes_;
    lock.unlock();
    const int error = writer_.sync(bytes) ? 0 : errno;
    lock.lock();
    sync_error_ = error;
    sync_bytes_.reset();
    wake_.notify_all();
  }
}

}  // namespace unimapper::spool
