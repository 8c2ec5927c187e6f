// Least-recently-used cache of shared values under a limit of bytes
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace unimapper::merge {

/// Values by key, each made by one thread while others that want it wait. What is in use lives on
/// when it is no longer kept. Thread safe.
template <typename Key, typename Value>
class LimitedCache {
 public:
  using Shared = std::shared_ptr<const Value>;

  /// `max_bytes`: of the values that are kept; the value that was made last always is.
  explicit LimitedCache(std::uint64_t max_bytes) : max_bytes_(max_bytes) {}

  /// The value of a key, by `make(key)` if it is not kept; `bytes(value)`: what it takes. What
  /// `make` throws is passed on.
  template <typename Make, typename Bytes>
  Shared get(const Key& key, const Make& make, const Bytes& bytes) {
    std::unique_lock<std::mutex> lock(guard_);
    for (auto found = entries_.find(key); found != entries_.end(); found = entries_.find(key)) {
      if (found->second.value == nullptr) {
        made_.wait(lock);
        continue;
      }
      order_.splice(order_.begin(), order_, found->second.place);
      return found->second.value;
    }
    entries_.emplace(key, Entry{});
    lock.unlock();
    Shared value;
    try {
      value = std::make_shared<const Value>(make(key));
    } catch (...) {
      lock.lock();
      entries_.erase(key);
      made_.notify_all();
      throw;
    }
    lock.lock();
    keep(key, value, bytes(*value));
    made_.notify_all();
    return value;
  }

  /// Keeps a value that was made elsewhere, of so many bytes, unless there is one of its key or
  /// another would have to be forgotten for it.
  void offer(const Key& key, Shared value, std::uint64_t bytes) {
    const std::lock_guard<std::mutex> lock(guard_);
    if (bytes_ + bytes > max_bytes_ || !entries_.try_emplace(key).second) return;
    keep(key, value, bytes);
  }

  /// Forgets the values of keys for which `is_stale(key)` holds. No other thread may be in `get`.
  template <typename IsStale>
  void forget_if(const IsStale& is_stale) {
    const std::lock_guard<std::mutex> lock(guard_);
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      const auto next = std::next(entry);
      if (is_stale(entry->first)) remove(entry);
      entry = next;
    }
  }

  /// Bytes of the values that are kept.
  [[nodiscard]] std::uint64_t bytes() const {
    const std::lock_guard<std::mutex> lock(guard_);
    return bytes_;
  }
  [[nodiscard]] std::uint64_t max_bytes() const { return max_bytes_; }

 private:
  struct Entry {
    Shared value{};  ///< null while it is made
    std::uint64_t bytes = 0;
    typename std::list<Key>::iterator place{};
  };
  using Entries = std::map<Key, Entry>;

  void keep(const Key& key, const Shared& value, std::uint64_t bytes) {
    Entry& entry = entries_.at(key);
    order_.push_front(key);
    entry = {value, bytes, order_.begin()};
    bytes_ += bytes;
    while (bytes_ > max_bytes_ && order_.size() > 1) remove(entries_.find(order_.back()));
  }

  void remove(typename Entries::iterator entry) {
    bytes_ -= entry->second.bytes;
    order_.erase(entry->second.place);
    entries_.erase(entry);
  }

  const std::uint64_t max_bytes_;
  mutable std::mutex guard_;
  std::condition_variable made_;
  Entries entries_;
  std::list<Key> order_;  ///< of what is kept, the latest used first
  std::uint64_t bytes_ = 0;
};

}  // namespace unimapper::merge
