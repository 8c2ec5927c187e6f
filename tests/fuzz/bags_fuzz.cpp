// Fuzz target of the readers of bags and of the decoders of their messages.
//
// Files are told apart by their first bytes as open_messages does; anything else is one message,
// whose first byte chooses kind and serialization. What a reader gives out is checked: places in
// order of time, points with a return, as many times and rings as points.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/formats.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using fuzz::allow_refusal;
using fuzz::require;

bool is_finite(const Scan::Point& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

void check_scan(const Scan& scan) {
  require(scan.time_s.empty() || scan.time_s.size() == scan.points.size());
  require(scan.ring.empty() || scan.ring.size() == scan.points.size());
  require(std::all_of(scan.points.begin(), scan.points.end(), is_finite));
  require(std::all_of(scan.time_s.begin(), scan.time_s.end(),
                      [](float time) { return std::isfinite(time); }));
}

void read_messages(const std::string& file) {
  const auto source = open_messages(file);
  for (std::size_t topic = 0; topic < source->topics().size(); ++topic) {
    std::int64_t last_ns = INT64_MIN;
    for (const MessagePlace& place : source->messages(topic)) {
      require(place.log_time_ns >= last_ns);
      last_ns = place.log_time_ns;
      // A message may be damaged; others are read on.
      allow_refusal<DatasetError>([&] { (void)source->read(place); });
    }
  }
}

void read_dataset(const std::string& file) {
  const auto dataset = open_bag(file, {});
  allow_refusal<DatasetError>([&] {
    const RecordedGyroscope gyroscope = dataset->gyroscope();
    require(std::is_sorted(gyroscope.samples.begin(), gyroscope.samples.end(),
                           [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; }));
  });
  Scan scan;
  for (const Fix& fix : dataset->fixes()) {
    require(std::abs(fix.latitude_deg) <= 90.0 && fix.sigma_xy_m > 0.0 && fix.sigma_z_m > 0.0);
  }
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    require(dataset->pose(i).is_finite());
    allow_refusal<DatasetError>([&] {
      dataset->read_scan(i, scan);
      check_scan(scan);
    });
  }
}

void decode(std::uint8_t choice, std::string_view bytes) {
  const auto serialization = (choice & 1) != 0 ? Serialization::kCdr : Serialization::kRos1;
  const auto kind = static_cast<MessageKind>((choice >> 1) % 10);
  if (kind == MessageKind::kFix) {
    (void)decode_fix(bytes, serialization);
    return;
  }
  if (kind == MessageKind::kImu) {
    const ImuMessage imu = decode_imu(bytes, serialization);
    require(!imu.rad_s || imu.rad_s->allFinite());
    return;
  }
  if (!is_scan(kind)) {
    for (const PoseMessage& pose : decode_poses(bytes, serialization, kind)) {
      require(!pose.pose || pose.pose->is_rigid());
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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes = fuzz::text_of(data, size);
  if (is_file(bytes)) {
    const std::string& file = fuzz::file_of({data, size});
    allow_refusal<DatasetError>([&] { read_messages(file); });
    allow_refusal<DatasetError>([&] { read_dataset(file); });
  } else {
    allow_refusal<DatasetError>([&] { decode(data[0], bytes.substr(1)); });
  }
  return 0;
}
