// LCM event logs, as lcm-logger writes and lcm-logplayer replays them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port {

using wire::Bytes;

/// A log could not be opened or written. The message names the file and the reason.
class EventLogError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One message of a log.
struct LogEvent {
  std::uint64_t offset = 0;        ///< of the event's first byte in the file
  std::int64_t number = 0;         ///< running number in the log, from 0
  std::int64_t stamp_us = 0;       ///< its time, microseconds
  std::string channel;             ///< LCM's name of the channel
  std::vector<std::uint8_t> data;  ///< the message as LCM encodes it
};

/// LCM's own limit on channel names, bytes.
inline constexpr std::size_t kMaxChannelBytes = 63;

/// Writes a log. The same events give the same bytes: nothing of the clock or the machine is
/// in them. A call that fails leaves the log as it was after the last `flush`, and the next one
/// goes on from there.
class EventLogWriter {
 public:
  /// Creates or truncates `path`. Throws EventLogError.
  explicit EventLogWriter(const std::filesystem::path& path);
  EventLogWriter(const EventLogWriter&) = delete;
  EventLogWriter& operator=(const EventLogWriter&) = delete;

  /// Appends one event. Throws EventLogError (disk full, channel name empty or too long).
  void write(std::int64_t stamp_us, std::string_view channel, Bytes data);
  /// Writes what is buffered. Throws EventLogError. The destructor flushes too, but silently.
  void flush();

 private:
  [[noreturn]] void fail();
  void open_again();

  std::filesystem::path path_;
  std::ofstream file_;
  std::int64_t next_number_ = 0;
  std::int64_t flushed_number_ = 0;   ///< of the next event after the last flush
  std::uintmax_t written_bytes_ = 0;  ///< of all events, some of them perhaps in the buffer
  std::uintmax_t flushed_bytes_ = 0;
  std::vector<std::uint8_t> buffer_;
};

/// A stretch of a log that held no event.
struct LogFault {
  std::uint64_t offset = 0;  ///< of its first byte in the file
  std::string reason;        ///< why it is no event
};

/// Reads a log front to back. Whatever is no event is skipped up to the next one and reported;
/// a torn tail costs the torn event only. Memory: one event, at most `max_event_bytes`.
class EventLogReader {
 public:
  /// Largest event read unless the caller says otherwise.
  static constexpr std::uint64_t kDefaultMaxEventBytes = 64U << 20U;
  /// Faults of a file that are reported one by one.
  static constexpr std::size_t kMaxFaultsKept = 16;

  /// Throws EventLogError if `path` cannot be read.
  explicit EventLogReader(const std::filesystem::path& path,
                          std::uint64_t max_event_bytes = kDefaultMaxEventBytes);

  /// The next event, into `event` (reusing its memory). False at the end of the file.
  bool next(LogEvent& event);

  /// The first faults found so far, at most `kMaxFaultsKept`, and how many there were.
  [[nodiscard]] const std::vector<LogFault>& faults() const { return faults_; }
  /// Faults found so far, those not kept as text included.
  [[nodiscard]] std::uint64_t fault_count() const { return fault_count_; }
  /// The faults as sentences, each with the file's name and the offset.
  [[nodiscard]] std::vector<std::string> fault_sentences() const;

 private:
  struct Header {
    std::int64_t number = 0;
    std::int64_t stamp_us = 0;
    std::uint64_t channel_bytes = 0;
    std::uint64_t data_bytes = 0;
    [[nodiscard]] std::uint64_t event_bytes() const;
  };

  /// Null if a whole event starts at `offset`, else why not.
  const char* read_header(std::uint64_t offset, Header& header);
  bool read_at(std::uint64_t offset, void* to, std::uint64_t bytes);
  bool continues_at(std::uint64_t offset);
  bool is_event(std::uint64_t offset);
  /// First offset in [from, to) at which a whole event starts, else `to`.
  std::uint64_t find_event(std::uint64_t from, std::uint64_t to);
  void report(std::uint64_t offset, const char* reason);

  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t max_event_bytes_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  std::vector<LogFault> faults_;
  std::uint64_t fault_count_ = 0;
};

}  // namespace unimapper::lcm_port
