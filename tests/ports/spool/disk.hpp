// Disk that fails, fills up or keeps its writer waiting.
#pragma once

#include <cerrno>
#include <system_error>

#include "ports/spool/spool.hpp"
#include "tests/test.hpp"

namespace unimapper::spool::spool_test {

/// What a disk does, set by a test while the spool runs.
struct Disk {
  std::atomic<int> write_error{0};
  std::atomic<int> sync_error{0};
  std::atomic<int> folder_error{0};
  std::atomic<bool> fails_once{false};  ///< an error is over when it has been met
  /// Bytes that fit; writing beyond fails in the middle. Removed files make room.
  std::atomic<std::int64_t> capacity{std::int64_t{1} << 40U};
  std::atomic<std::int64_t> used{0};
  std::atomic<bool> blocks{false};
  std::atomic<int> waiting{0};  ///< syncs begun while it blocks
};

class FaultyFiles : public Files {
 public:
  explicit FaultyFiles(Disk& disk) : disk_(disk) {}

  bool write(int file, wire::Bytes bytes) override {
    if (fails(disk_.write_error)) return false;
    const std::int64_t room = disk_.capacity - disk_.used;
    const auto fits = static_cast<std::size_t>(
        std::clamp<std::int64_t>(room, 0, static_cast<std::int64_t>(bytes.size())));
    disk_.used += static_cast<std::int64_t>(fits);
    if (!Files::write(file, bytes.first(fits))) return false;
    errno = ENOSPC;
    return fits == bytes.size();
  }
  bool sync(int file) override {
    if (disk_.blocks) ++disk_.waiting;
    while (disk_.blocks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return !fails(disk_.sync_error) && Files::sync(file);
  }
  bool remove(const std::filesystem::path& file) override {
    std::error_code ignored;
    disk_.used -= static_cast<std::int64_t>(std::filesystem::file_size(file, ignored));
    return Files::remove(file);
  }
  bool make_folder(const std::filesystem::path& path) override {
    return !fails(disk_.folder_error) && Files::make_folder(path);
  }

 private:
  bool fails(std::atomic<int>& error) {
    errno = disk_.fails_once ? error.exchange(0) : error.load();
    return errno != 0;
  }
  Disk& disk_;
};

inline std::unique_ptr<Files> on(Disk& disk) { return std::make_unique<FaultyFiles>(disk); }

template <typename Condition>
void wait_until(const Condition& condition) {
  while (!condition()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

inline void wait_until_failing(const Spool& spool) {
  wait_until([&] { return spool.counters().failing; });
}

inline void wait_until_written(const Spool& spool, std::uint64_t keyframes) {
  wait_until([&] { return spool.counters().keyframes_durable >= keyframes; });
}

}  // namespace unimapper::spool::spool_test
