#include "ports/spool/segment_writer.hpp"

#include "ports/spool/segment.hpp"

namespace unimapper::spool {

bool SegmentWriter::begin(std::uint64_t number) {
  close();
  number_ = number;
  bytes_ = 0;
  synced_ = 0;
  named_ = false;
  file_ = files_.create(folder_ / segment_name(number));
  return file_ >= 0 && append(segment_head());
}

bool SegmentWriter::append(wire::Bytes bytes) {
  if (!files_.write(file_, bytes)) return false;
  bytes_ += bytes.size();
  return true;
}

bool SegmentWriter::sync(std::uint64_t bytes) {
  if (!files_.sync(file_)) return false;
  if (!named_ && !files_.sync_folder(folder_)) return false;
  named_ = true;
  synced_ = bytes;
  return true;
}

void SegmentWriter::close() {
  if (file_ >= 0) files_.close(file_);
  file_ = -1;
}

void SegmentWriter::abandon() {
  if (file_ >= 0) (void)files_.truncate(file_, synced_);
  close();
}

}  // namespace unimapper::spool
