#include "ports/lcm/event_log.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace unimapper::lcm_port {

namespace {

constexpr std::uint32_t kMagic = 0xEDA1DA01;
constexpr std::array<std::uint8_t, 4> kMagicBytes{0xED, 0xA1, 0xDA, 0x01};
constexpr std::uint64_t kHeaderBytes = 28;
constexpr std::size_t kLargestBlockBytes = std::size_t{64} << 10U;

std::string because() { return errno != 0 ? std::strerror(errno) : "unknown reason"; }

}  // namespace

EventLogWriter::EventLogWriter(const std::filesystem::path& path) : path_(path) {
  errno = 0;
  file_.open(path, std::ios::binary | std::ios::trunc);
  if (!file_) throw EventLogError(path.string() + ": cannot be written: " + because());
}

void EventLogWriter::write(std::int64_t stamp_us, std::string_view channel, Bytes data) {
  if (channel.empty() || channel.size() > kMaxChannelBytes) {
    throw EventLogError(path_.string() + ": a channel name needs 1 to 63 bytes");
  }
  if (data.size() > INT32_MAX) throw EventLogError(path_.string() + ": a message exceeds 2 GiB");
  if (!file_.is_open()) open_again();
  buffer_.clear();
  wire::BigEndianWriter out(buffer_);
  out.put(kMagic);
  out.put(next_number_++);
  out.put(stamp_us);
  out.put(static_cast<std::uint32_t>(channel.size()));
  out.put(static_cast<std::uint32_t>(data.size()));
  buffer_.insert(buffer_.end(), channel.begin(), channel.end());
  buffer_.insert(buffer_.end(), data.begin(), data.end());
  errno = 0;
  file_.write(reinterpret_cast<const char*>(buffer_.data()),
              static_cast<std::streamsize>(buffer_.size()));
  if (!file_) fail();
  written_bytes_ += buffer_.size();
}

void EventLogWriter::flush() {
  if (!file_.is_open()) open_again();
  errno = 0;
  if (!file_.flush()) fail();
  flushed_bytes_ = written_bytes_;
  flushed_number_ = next_number_;
}

/// How much of the buffer has reached the file is unknown: the file is cut at what is known.
void EventLogWriter::fail() {
  const EventLogError error(path_.string() + ": cannot be written: " + because());
  file_.close();
  std::error_code again;  // when it is opened
  std::filesystem::resize_file(path_, flushed_bytes_, again);
  written_bytes_ = flushed_bytes_;
  next_number_ = flushed_number_;
  throw error;
}

void EventLogWriter::open_again() {
  std::error_code failure;
  std::filesystem::resize_file(path_, flushed_bytes_, failure);
  errno = failure.value();
  if (!failure) file_.open(path_, std::ios::binary | std::ios::app);
  if (failure || !file_) {
    const EventLogError error(path_.string() + ": cannot be written: " + because());
    file_.close();
    throw error;
  }
}

std::uint64_t EventLogReader::Header::event_bytes() const {
  return kHeaderBytes + channel_bytes + data_bytes;
}

EventLogReader::EventLogReader(const std::filesystem::path& path, std::uint64_t max_event_bytes)
    : path_(path), max_event_bytes_(max_event_bytes) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw EventLogError(path.string() + ": is a directory, not an event log");
  }
  errno = 0;
  file_.open(path, std::ios::binary | std::ios::ate);
  if (!file_) throw EventLogError(path.string() + ": cannot be read: " + because());
  size_ = static_cast<std::uint64_t>(file_.tellg());
}

bool EventLogReader::read_at(std::uint64_t offset, void* to, std::uint64_t bytes) {
  if (offset > size_ || bytes > size_ - offset) return false;
  file_.clear();
  // Events follow one another: seeking anyway would throw the stream's buffer away.
  if (static_cast<std::uint64_t>(file_.tellg()) != offset) {
    file_.seekg(static_cast<std::streamoff>(offset));
  }
  file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
  return static_cast<std::uint64_t>(file_.gcount()) == bytes;
}

const char* EventLogReader::read_header(std::uint64_t offset, Header& header) {
  std::array<std::uint8_t, kHeaderBytes> bytes;
  if (!read_at(offset, bytes.data(), bytes.size())) return "the log ends within an event's header";
  wire::BigEndianReader in(bytes);
  if (in.get<std::uint32_t>() != kMagic) return "no event starts here";
  header.number = in.get<std::int64_t>();
  header.stamp_us = in.get<std::int64_t>();
  header.channel_bytes = in.get<std::uint32_t>();
  header.data_bytes = in.get<std::uint32_t>();
  if (header.channel_bytes == 0 || header.channel_bytes > kMaxChannelBytes) {
    return "an event's channel name has an impossible length";
  }
  if (header.data_bytes > INT32_MAX) return "an event's data has an impossible length";
  if (header.event_bytes() > size_ - offset) return "the log ends within an event";
  return nullptr;
}

bool EventLogReader::is_event(std::uint64_t offset) {
  Header header;
  return read_header(offset, header) == nullptr;
}

bool EventLogReader::continues_at(std::uint64_t offset) {
  std::array<std::uint8_t, 4> bytes{};
  const std::uint64_t available = std::min<std::uint64_t>(bytes.size(), size_ - offset);
  if (!read_at(offset, bytes.data(), available)) return false;
  return std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(available),
                    kMagicBytes.begin());
}

std::uint64_t EventLogReader::find_event(std::uint64_t from, std::uint64_t to) {
  // Small at first: the next event is mostly near, and a forged log can ask many times.
  std::vector<std::uint8_t> block(256);
  for (std::uint64_t offset = from; offset < to;) {
    const std::uint64_t bytes = std::min<std::uint64_t>(block.size(), size_ - offset);
    if (bytes < kMagicBytes.size() || !read_at(offset, block.data(), bytes)) return to;
    const auto end = block.begin() + static_cast<std::ptrdiff_t>(bytes);
    auto at = block.begin();
    while ((at = std::search(at, end, kMagicBytes.begin(), kMagicBytes.end())) != end) {
      const std::uint64_t found = offset + static_cast<std::uint64_t>(at - block.begin());
      if (found >= to) return to;
      if (is_event(found)) return found;
      ++at;
    }
    // The last three bytes may be the start of a magic word that the next block completes.
    offset += bytes - (kMagicBytes.size() - 1);
    if (block.size() < kLargestBlockBytes) block.resize(2 * block.size());
  }
  return to;
}

void EventLogReader::report(std::uint64_t offset, const char* reason) {
  ++fault_count_;
  if (faults_.size() < kMaxFaultsKept) faults_.push_back({offset, reason});
}

bool EventLogReader::next(LogEvent& event) {
  while (position_ < size_) {
    Header header;
    if (const char* fault = read_header(position_, header)) {
      report(position_, fault);
      position_ = find_event(position_ + 1, size_);
      continue;
    }
    const std::uint64_t end = position_ + header.event_bytes();
    if (!continues_at(end)) {
      // Either rubbish follows a good event, or its length is wrong and swallows the next ones.
      const std::uint64_t inner = find_event(position_ + 1, end);
      if (inner != end) {
        report(position_, "an event's length is wrong");
        position_ = inner;
        continue;
      }
    }
    const std::uint64_t start = std::exchange(position_, end);
    if (header.data_bytes > max_event_bytes_) {
      report(start, "an event is larger than the limit");
      continue;
    }
    event.offset = start;
    event.number = header.number;
    event.stamp_us = header.stamp_us;
    event.channel.resize(static_cast<std::size_t>(header.channel_bytes));
    event.data.resize(static_cast<std::size_t>(header.data_bytes));
    if (read_at(start + kHeaderBytes, event.channel.data(), header.channel_bytes) &&
        read_at(start + kHeaderBytes + header.channel_bytes, event.data.data(),
                header.data_bytes)) {
      return true;
    }
    report(start, "the file could not be read");
  }
  return false;
}

std::vector<std::string> EventLogReader::fault_sentences() const {
  std::vector<std::string> sentences;
  for (const LogFault& fault : faults_) {
    sentences.push_back(path_.string() + ": at byte " + std::to_string(fault.offset) + ": " +
                        fault.reason);
  }
  if (fault_count_ > faults_.size()) {
    sentences.push_back(path_.string() + ": " + std::to_string(fault_count_ - faults_.size()) +
                        " more faults");
  }
  return sentences;
}

}  // namespace unimapper::lcm_port
