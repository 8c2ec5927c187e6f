// Fuzz target of a spool's segments.
//
// The input is written as a whole segment, then as what comes between a segment's head and a
// keyframe that was written whole. Records lie in sequence within the file, and the keyframe is
// found and whole unless a record of the input claims its bytes.
#include <cstdint>
#include <string>
#include <vector>

#include "ports/spool/segment.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::spool;
using fuzz::file_of;
using fuzz::require;

/// Reads all records; true if bytes at `victim` belong to one.
bool read_all(const std::string& path, std::uint64_t size, std::uint64_t victim) {
  SegmentReader reader(path);
  const InputFile file(path);
  Record record;
  std::uint64_t end = kSegmentHeadBytes;
  bool claimed = false;
  while (reader.next(record)) {
    require(record.data_offset >= end + kRecordHeadBytes);
    claimed = claimed || record.data_offset + record.data_bytes > victim;
    end = record.data_offset + record.data_bytes;
    require(end <= size);
    (void)read_data(file, record.data_offset, record.data_bytes, record.data_crc32);
  }
  return claimed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)read_all(file_of({data, size}), size, size);

  const SessionInfo info{{1, 2}, "robot", "vlp-16"};
  const EncodedKeyframe keyframe{info.id, 5, 7, std::vector<std::uint8_t>(40, 9)};
  std::vector<std::uint8_t> bytes = segment_head();
  bytes.insert(bytes.end(), data, data + size);
  const std::vector<std::uint8_t> head = keyframe_head(info, keyframe, 1);
  bytes.insert(bytes.end(), head.begin(), head.end());
  const std::uint64_t victim = bytes.size();
  bytes.insert(bytes.end(), keyframe.bytes.begin(), keyframe.bytes.end());
  require(read_all(file_of(bytes), bytes.size(), victim));
  return 0;
}
