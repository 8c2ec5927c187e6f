// Writer of one segment file after the other.
#pragma once

#include <cstdint>
#include <filesystem>

#include "ports/spool/files.hpp"

namespace unimapper::spool {

/// The segment that is being written. Functions that return false leave the reason in `errno`; the
/// segment must then be abandoned, since what a failed sync left on disk is unknown.
class SegmentWriter {
 public:
  /// Both outlive it.
  SegmentWriter(Files& files, const std::filesystem::path& folder)
      : files_(files), folder_(folder) {}
  ~SegmentWriter() { close(); }
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;

  /// Makes the file and writes its head.
  bool begin(std::uint64_t number);
  /// Writes at the end.
  bool append(wire::Bytes bytes);
  /// Waits for the disk: the first `bytes`, all appended before the call, survive from now on. May
  /// run beside `append` on another thread, but beside nothing else.
  bool sync(std::uint64_t bytes);
  /// Closes the file as it is.
  void close();
  /// Takes back what was not synced, as far as possible, and closes the file.
  void abandon();

  /// Whether there is a segment.
  [[nodiscard]] bool is_open() const { return file_ >= 0; }
  /// Its number.
  [[nodiscard]] std::uint64_t number() const { return number_; }
  /// Bytes written to it; of the thread that appends.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Bytes of it that survive.
  [[nodiscard]] std::uint64_t synced_bytes() const { return synced_; }

 private:
  Files& files_;
  const std::filesystem::path& folder_;
  int file_ = -1;
  std::uint64_t number_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t synced_ = 0;
  bool named_ = false;  ///< the folder was synced since the file is in it
};

}  // namespace unimapper::spool
