// Segment files of a spool: their records, written and read whatever the bytes are.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ports/spool/files.hpp"
#include "unimapper/wire/delivery.hpp"
#include "unimapper/wire/pieces.hpp"

namespace unimapper::spool {

using wire::EncodedKeyframe;

/// What a record says.
enum class RecordKind : std::uint32_t {
  kKeyframe = 1,      ///< an encoded keyframe of a session
  kAcknowledged = 2,  ///< sequence numbers that a base has stored
  kEnded = 3,         ///< a base has confirmed the end of a session
};

/// Bytes that begin a segment.
inline constexpr std::uint64_t kSegmentHeadBytes = 16;
/// A record without its description and data.
inline constexpr std::uint64_t kRecordHeadBytes = 24;
/// Longest description of a record.
inline constexpr std::uint32_t kMaxDescriptionBytes = 256;
/// What a segment with one keyframe takes besides it at most, but for many gaps in what is stored.
inline constexpr std::uint64_t kSegmentOverheadBytes = 65536;
/// Longest segment that is read.
inline constexpr std::uint64_t kMaxSegmentBytes = std::uint64_t{1} << 30U;

/// One record without a keyframe's own bytes.
struct Record {
  RecordKind kind = RecordKind::kKeyframe;  ///< what it says
  SessionInfo info;  ///< of the session; where `kind` is not `kKeyframe`, the identity alone
  std::uint32_t sequence = 0;                     ///< of the keyframe
  std::int64_t stamp_ns = 0;                      ///< of the keyframe
  std::int64_t written_s = 0;                     ///< by the robot's clock, since 1970
  std::vector<wire::SequenceRange> acknowledged;  ///< of `kAcknowledged`
  std::uint64_t data_offset = 0;                  ///< of the data in the segment
  std::uint32_t data_bytes = 0;                   ///< of the data
  std::uint32_t data_crc32 = 0;                   ///< of the data
};

/// Name of the segment with this number.
[[nodiscard]] std::string segment_name(std::uint64_t number);
/// The number in such a name; nothing for other names.
[[nodiscard]] std::optional<std::uint64_t> segment_number(const std::string& name);

/// First bytes of every segment.
[[nodiscard]] std::vector<std::uint8_t> segment_head();
/// The record of a keyframe up to its data, which are the keyframe's bytes. `info.name` and
/// `info.sensor` hold at most 64 bytes each; more is cut off.
[[nodiscard]] std::vector<std::uint8_t> keyframe_head(const SessionInfo& info,
                                                      const EncodedKeyframe& keyframe,
                                                      std::int64_t written_s);
/// The whole record of numbers that are stored at a base.
[[nodiscard]] std::vector<std::uint8_t> acknowledged_record(
    const SessionId& session, std::span<const wire::SequenceRange> ranges);
/// The whole record of a session that has ended.
[[nodiscard]] std::vector<std::uint8_t> ended_record(const SessionId& session);

/// Reads a segment front to back. Bytes that are no record are passed over up to the next one and
/// counted, so a torn tail costs the torn record and a damaged head its own record. A keyframe's
/// data are not read and may be damaged: see `read_data`. Never allocates more than the file's
/// bytes.
class SegmentReader {
 public:
  /// Opens the file; see `ok`.
  explicit SegmentReader(const std::filesystem::path& file);

  /// Whether it is a segment of this version, or one that was torn before its first record, and
  /// could be read.
  [[nodiscard]] bool ok() const { return ok_; }
  /// The next record. False at the end.
  bool next(Record& record);
  /// Stretches that were no record.
  [[nodiscard]] std::uint64_t faults() const { return faults_; }
  /// Bytes of the file.
  [[nodiscard]] std::uint64_t bytes() const { return file_.size(); }

 private:
  [[nodiscard]] bool read_record(std::uint64_t offset, Record& record);
  [[nodiscard]] bool read_data(Record& record);
  [[nodiscard]] std::uint64_t find_record(std::uint64_t from);

  InputFile file_;
  std::uint64_t position_ = kSegmentHeadBytes;
  std::uint64_t faults_ = 0;
  std::vector<std::uint8_t> buffer_;
  bool ok_ = false;
};

/// The bytes of a keyframe whose record was read; nothing if they are damaged.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> read_data(const InputFile& file,
                                                                 std::uint64_t offset,
                                                                 std::uint32_t bytes,
                                                                 std::uint32_t crc32);

}  // namespace unimapper::spool
