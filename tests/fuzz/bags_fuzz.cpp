// Fuzz target of the readers of bags and of the decoders of their messages.
//
// Files are told apart by their first bytes as open_messages does; anything else is one message,
// whose first byte chooses kind and serialization. What a reader gives out is checked: places in
// order of time, points with a return, as many times and rings as points.
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/formats.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;

/// The input as a file.
std::string file_of(std::string_view bytes) {
  static const int file = memfd_create("bag", 0);
  if (ftruncate(file, 0) != 0 ||
      pwrite(file, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    std::abort();
  }
  return "/proc/self/fd/" + std::to_string(file);
}

void check_scan(const Scan& scan) {
  if (!scan.time_s.empty() && scan.time_s.size() != scan.points.size()) std::abort();
  if (!scan.ring.empty() && scan.ring.size() != scan.points.size()) std::abort();
  for (const Scan::Point& point : scan.points) {
    if (!std::isfinite(point.x) || !std::isfinite(point.y) || !std::isfinite(point.z)) std::abort();
  }
  for (const float time : scan.time_s) {
    if (!std::isfinite(time)) std::abort();
  }
}

void read_messages(const std::string& file) {
  const auto source = open_messages(file);
  for (std::size_t topic = 0; topic < source->topics().size(); ++topic) {
    std::int64_t last_ns = INT64_MIN;
    for (const MessagePlace& place : source->messages(topic)) {
      if (place.log_time_ns < last_ns) std::abort();
      last_ns = place.log_time_ns;
      try {
        (void)source->read(place);
      } catch (const DatasetError&) {
        // A message may be damaged; others are read on.
      }
    }
  }
}

void read_dataset(const std::string& file) {
  const auto dataset = open_bag(file, {});
  Scan scan;
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    if (!dataset->pose(i).is_finite()) std::abort();
    try {
      dataset->read_scan(i, scan);
      check_scan(scan);
    } catch (const DatasetError&) {
      // As above.
    }
  }
}

void decode(std::uint8_t choice, std::string_view bytes) {
  const auto serialization = (choice & 1) != 0 ? Serialization::kCdr : Serialization::kRos1;
  const auto kind = static_cast<MessageKind>((choice >> 1) % 8);
  if (!is_scan(kind)) {
    for (const PoseMessage& pose : decode_poses(bytes, serialization, kind)) {
      if (pose.pose && !pose.pose->is_rigid()) std::abort();
    }
    return;
  }
  Scan scan;
  decode_scan(bytes, serialization, kind, find_layout(bytes, serialization, kind), scan);
  check_scan(scan);
}

bool is_file(std::string_view bytes) {
  return bytes.starts_with("\x89MCAP") || bytes.starts_with("SQLite format 3") ||
         bytes.starts_with("#ROSBAG");
}

template <typename Call>
void allow_refusal(const Call& call) {
  try {
    call();
  } catch (const DatasetError&) {
    // The one way to refuse; anything else ends the fuzzer.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (is_file(bytes)) {
    const std::string file = file_of(bytes);
    allow_refusal([&] { read_messages(file); });
    allow_refusal([&] { read_dataset(file); });
  } else {
    allow_refusal([&] { decode(data[0], bytes.substr(1)); });
  }
  return 0;
}
