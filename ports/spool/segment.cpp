#include "ports/spool/segment.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::spool {

namespace {

using wire::BigEndianReader;
using wire::BigEndianWriter;
using wire::Bytes;

constexpr std::uint64_t kSegmentMagic = 0x554D53504F4F4C00;  // "UMSPOOL" and a zero
constexpr std::uint32_t kSegmentVersion = 1;
constexpr std::uint32_t kRecordMagic = 0x554D5352;  // "UMSR"
constexpr std::string_view kExtension = ".spool";
constexpr std::size_t kNameDigits = 16;
constexpr std::size_t kMaxTextBytes = 64;
constexpr std::uint64_t kEndOfSequences = std::uint64_t{1} << 32U;

/// A session takes 20 bytes.
void put(BigEndianWriter& writer, const SessionId& id) {
  writer.put(id.robot);
  writer.put(id.boot.high);
  writer.put(id.boot.low);
}

SessionId get_session(BigEndianReader& reader) {
  SessionId id;
  id.robot = reader.get<std::uint32_t>();
  id.boot.high = reader.get<std::uint64_t>();
  id.boot.low = reader.get<std::uint64_t>();
  return id;
}

void put(BigEndianWriter& writer, const std::string& text) {
  const std::size_t bytes = std::min(text.size(), kMaxTextBytes);
  writer.put(static_cast<std::uint8_t>(bytes));
  writer.put(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), bytes));
}

std::string get_text(BigEndianReader& reader) {
  const Bytes bytes = reader.get_bytes(reader.get<std::uint8_t>());
  return {bytes.begin(), bytes.end()};
}

/// Head and description; the head's checksum covers both.
std::vector<std::uint8_t> record_head(RecordKind kind, Bytes description, Bytes data) {
  std::vector<std::uint8_t> head;
  BigEndianWriter writer(head);
  writer.put(kRecordMagic);
  writer.put(static_cast<std::uint32_t>(kind));
  writer.put(static_cast<std::uint32_t>(description.size()));
  writer.put(static_cast<std::uint32_t>(data.size()));
  writer.put(wire::crc32(data));
  std::vector<std::uint8_t> covered = head;
  covered.insert(covered.end(), description.begin(), description.end());
  writer.put(wire::crc32(covered));
  writer.put(description);
  return head;
}

bool has_checksum(Bytes head, Bytes description) {
  BigEndianReader expected(head.subspan(kRecordHeadBytes - 4));
  const Bytes before = head.first(kRecordHeadBytes - 4);
  std::vector<std::uint8_t> covered(before.begin(), before.end());
  covered.insert(covered.end(), description.begin(), description.end());
  return wire::crc32(covered) == expected.get<std::uint32_t>();
}

bool read_description(Bytes description, Record& record) {
  BigEndianReader reader(description);
  record.info = {};
  record.info.id = get_session(reader);
  if (record.kind == RecordKind::kKeyframe) {
    record.sequence = reader.get<std::uint32_t>();
    record.stamp_ns = reader.get<std::int64_t>();
    record.written_s = reader.get<std::int64_t>();
    record.info.name = get_text(reader);
    record.info.sensor = get_text(reader);
  }
  return reader.ok() && reader.remaining() == 0;
}

bool read_ranges(Bytes data, std::vector<wire::SequenceRange>& ranges) {
  BigEndianReader reader(data);
  while (reader.ok() && reader.remaining() > 0) {
    const auto begin = reader.get<std::uint64_t>();
    const auto end = reader.get<std::uint64_t>();
    if (!reader.ok() || begin >= end || end > kEndOfSequences) return false;
    if (!ranges.empty() && begin < ranges.back().end) return false;
    ranges.push_back({begin, end});
  }
  return reader.ok();
}

}  // namespace

std::string segment_name(std::uint64_t number) {
  std::array<char, kNameDigits> digits{};
  const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), number, 16);
  const std::string text(digits.data(), written.ptr);
  return std::string(kNameDigits - text.size(), '0') + text + std::string(kExtension);
}

std::optional<std::uint64_t> segment_number(const std::string& name) {
  if (name.size() != kNameDigits + kExtension.size() || !name.ends_with(kExtension)) {
    return std::nullopt;
  }
  std::uint64_t number = 0;
  const char* const end = name.data() + kNameDigits;
  const auto read = std::from_chars(name.data(), end, number, 16);
  if (read.ec != std::errc{} || read.ptr != end) return std::nullopt;
  return name == segment_name(number) ? std::optional(number) : std::nullopt;
}

std::vector<std::uint8_t> segment_head() {
  std::vector<std::uint8_t> head;
  BigEndianWriter writer(head);
  writer.put(kSegmentMagic);
  writer.put(kSegmentVersion);
  writer.put(wire::crc32(head));
  return head;
}

std::vector<std::uint8_t> keyframe_head(const SessionInfo& info, const EncodedKeyframe& keyframe,
                                        std::int64_t written_s) {
  std::vector<std::uint8_t> description;
  BigEndianWriter writer(description);
  put(writer, info.id);
  writer.put(keyframe.sequence);
  writer.put(keyframe.stamp_ns);
  writer.put(written_s);
  put(writer, info.name);
  put(writer, info.sensor);
  return record_head(RecordKind::kKeyframe, description, keyframe.bytes);
}

std::vector<std::uint8_t> acknowledged_record(const SessionId& session,
                                              std::span<const wire::SequenceRange> ranges) {
  std::vector<std::uint8_t> description;
  BigEndianWriter describe(description);
  put(describe, session);
  std::vector<std::uint8_t> data;
  BigEndianWriter writer(data);
  for (const wire::SequenceRange& range : ranges) {
    writer.put(range.begin);
    writer.put(range.end);
  }
  std::vector<std::uint8_t> record = record_head(RecordKind::kAcknowledged, description, data);
  record.insert(record.end(), data.begin(), data.end());
  return record;
}

std::vector<std::uint8_t> ended_record(const SessionId& session) {
  std::vector<std::uint8_t> description;
  BigEndianWriter writer(description);
  put(writer, session);
  return record_head(RecordKind::kEnded, description, {});
}

SegmentReader::SegmentReader(const std::filesystem::path& file) : file_(file) {
  // A writer that was killed leaves less than the head.
  const auto bytes = static_cast<std::size_t>(std::min(file_.size(), kSegmentHeadBytes));
  const std::vector<std::uint8_t> head = segment_head();
  ok_ = file_.ok() && file_.size() <= kMaxSegmentBytes && file_.read(0, bytes, buffer_) &&
        std::equal(buffer_.begin(), buffer_.end(), head.begin());
}

bool SegmentReader::read_record(std::uint64_t offset, Record& record) {
  if (!file_.read(offset, kRecordHeadBytes, buffer_)) return false;
  const std::vector<std::uint8_t> head = buffer_;
  BigEndianReader reader(head);
  if (reader.get<std::uint32_t>() != kRecordMagic) return false;
  const auto kind = reader.get<std::uint32_t>();
  const auto description_bytes = reader.get<std::uint32_t>();
  record.kind = static_cast<RecordKind>(kind);
  record.data_bytes = reader.get<std::uint32_t>();
  record.data_crc32 = reader.get<std::uint32_t>();
  if (kind < static_cast<std::uint32_t>(RecordKind::kKeyframe) ||
      kind > static_cast<std::uint32_t>(RecordKind::kEnded) ||
      description_bytes > kMaxDescriptionBytes ||
      !file_.read(offset + kRecordHeadBytes, description_bytes, buffer_) ||
      !has_checksum(head, buffer_) || !read_description(buffer_, record)) {
    return false;
  }
  record.data_offset = offset + kRecordHeadBytes + description_bytes;
  // A torn tail: the record is longer than the file.
  return record.data_bytes <= file_.size() - record.data_offset && read_data(record);
}

/// The data of all records but keyframes, which are small.
bool SegmentReader::read_data(Record& record) {
  record.acknowledged.clear();
  if (record.kind == RecordKind::kKeyframe) return true;
  const auto data =
      spool::read_data(file_, record.data_offset, record.data_bytes, record.data_crc32);
  if (!data) return false;
  return record.kind == RecordKind::kAcknowledged ? read_ranges(*data, record.acknowledged)
                                                  : data->empty();
}

/// Where the next record begins, or the file's end.
std::uint64_t SegmentReader::find_record(std::uint64_t from) {
  constexpr std::size_t kWindow = std::size_t{1} << 16U;
  Record ignored;
  std::vector<std::uint8_t> window;
  while (from + kRecordHeadBytes <= file_.size()) {
    const auto bytes =
        static_cast<std::size_t>(std::min<std::uint64_t>(kWindow, file_.size() - from));
    if (!file_.read(from, bytes, window)) break;
    for (std::size_t i = 0; i + 4 <= bytes; ++i) {
      BigEndianReader reader(Bytes(window).subspan(i));
      if (reader.get<std::uint32_t>() == kRecordMagic && read_record(from + i, ignored)) {
        return from + i;
      }
    }
    from += bytes - 3;
  }
  return file_.size();
}

bool SegmentReader::next(Record& record) {
  if (!ok_ || position_ >= file_.size()) return false;
  if (!read_record(position_, record)) {
    ++faults_;
    position_ = find_record(position_ + 1);
    if (position_ >= file_.size() || !read_record(position_, record)) return false;
  }
  position_ = record.data_offset + record.data_bytes;
  return true;
}

std::optional<std::vector<std::uint8_t>> read_data(const InputFile& file, std::uint64_t offset,
                                                   std::uint32_t bytes, std::uint32_t crc32) {
  std::vector<std::uint8_t> data;
  if (!file.ok() || !file.read(offset, bytes, data) || wire::crc32(data) != crc32) {
    return std::nullopt;
  }
  return data;
}

}  // namespace unimapper::spool
