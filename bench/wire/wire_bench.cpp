// Benchmark of the wire: bytes and milliseconds of the keyframes of a run.
//   bench_wire RUN/keyframes.lcmlog...
#include <zlib.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/lcm/received_log.hpp"
#include "ports/lcm/sending.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"
#include "unimapper/wire/keyframe_queue.hpp"

namespace {

using namespace unimapper;
using Payload = std::vector<std::uint8_t>;

constexpr int kRepeats = 5;

/// The fastest of a few runs, which other load affects least.
double best_ms(const std::function<void()>& work) {
  double best = 1e300;
  for (int i = 0; i < kRepeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
  }
  return best;
}

Payload deflated(const Payload& payload, int level) {
  uLongf bytes = compressBound(payload.size());
  Payload out(bytes);
  compress2(out.data(), &bytes, payload.data(), payload.size(), level);
  out.resize(bytes);
  return out;
}

/// A keyframe as the pipeline delivers it, from its record: cells not in the wire's order, images
/// as pixels.
struct RobotKeyframe {
  std::vector<FineCell> static_cells;
  std::vector<std::vector<std::uint16_t>> pixels;
  std::vector<FreeSpaceImage> images;
  KeyframeContent content;

  explicit RobotKeyframe(const KeyframeRecord& record) : static_cells(record.static_cells) {
    std::stable_sort(
        static_cells.begin(), static_cells.end(),
        [](const FineCell& a, const FineCell& b) { return a.position.norm() < b.position.norm(); });
    const std::size_t size = ImageProjection(record.image_shape).pixels();
    for (const CodedImage& image : record.images) {
      (void)decode_image(image.code, pixels.emplace_back(size));
    }
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      images.push_back({record.images[i].scan, pixels[i]});
    }
    content.reference_scan = record.reference_scan;
    content.scans = record.scans;
    content.T_odometry_keyframe = record.T_odometry_keyframe;
    content.cell_size_m = record.cell_size_m;
    content.static_cells = static_cells;
    content.dynamic_cells = record.dynamic_cells;
    content.image_shape = record.image_shape;
    content.image_full_weight_range_m = record.image_full_weight_range_m;
    content.images = images;
    content.place = record.place();
  }
  RobotKeyframe(const RobotKeyframe&) = delete;
  RobotKeyframe& operator=(const RobotKeyframe&) = delete;
};

/// An encoder with its scratch memory and its buffer.
class OwnedEncoder {
 public:
  explicit OwnedEncoder(const KeyframeRecord& record) {
    const auto cells = static_cast<std::uint32_t>(
        std::max(record.static_cells.size(), record.dynamic_cells.size()));
    memory_.resize(wire::KeyframeEncoder::required_bytes(cells) / sizeof(CacheLine));
    encoder_ =
        wire::KeyframeEncoder::create(cells, std::as_writable_bytes(std::span(memory_))).value();
    buffer_.resize(std::size_t{4} << 20U);
  }
  void encode(const KeyframeContent& content) {
    const wire::EncodeResult result = encoder_.encode(content, {}, buffer_);
    if (result.error.code != ErrorCode::kOk) throw std::runtime_error(result.error.message);
  }

 private:
  struct alignas(64) CacheLine {
    std::byte bytes[64];
  };
  std::vector<CacheLine> memory_;
  wire::KeyframeEncoder encoder_;
  Payload buffer_;
};

/// A queue as before the thread that encodes, always with room: every copy goes to another slot.
class OwnedQueue {
 public:
  explicit OwnedQueue(const KeyframeContent& content)
      : queue_(room_of(content), wire::KeyframeQueue::kMaxSlots) {}
  void copy(const KeyframeContent& content) {
    if (queue_->push(content, true) == wire::HandedOver::kTooLarge) {
      throw std::runtime_error("a keyframe larger than its own room");
    }
  }

 private:
  static wire::KeyframeRoom room_of(const KeyframeContent& content) {
    const std::size_t cells = content.static_cells.size() + content.dynamic_cells.size();
    return {static_cast<std::uint32_t>(content.scans.size()), static_cast<std::uint32_t>(cells),
            static_cast<std::uint32_t>(content.place.keypoints.size()),
            static_cast<std::uint32_t>(content.images.size()),
            ImageProjection(content.image_shape).pixels()};
  }
  Owned<wire::KeyframeQueue> queue_;
};

/// One figure per keyframe and its name.
struct Column {
  const char* name;
  std::vector<double> values;
};

void measure(const KeyframeRecord& record, std::vector<Column>& columns) {
  const Payload payload = wire::encode_keyframe(record);
  const RobotKeyframe robot(record);
  OwnedEncoder owned(record);
  OwnedQueue queue(robot.content);
  Payload fast;
  Payload small;
  std::size_t next = 0;
  const auto add = [&](const char* name, double value) {
    if (columns.size() == next) columns.push_back({name, {}});
    columns[next++].values.push_back(value);
  };
  const auto cells = static_cast<double>(record.static_cells.size() + record.dynamic_cells.size());
  const auto bytes = static_cast<double>(payload.size());
  add("cells", cells);
  add("keypoints", static_cast<double>(record.keypoints.size()));
  add("planes", static_cast<double>(record.planes.size()));
  add("bytes", bytes);
  add("bytes per cell", bytes / cells);
  add("bytes with 7 per cell", bytes + 7.0 * cells - 4.0 * cells);
  add("encode on the robot ms", best_ms([&] { owned.encode(robot.content); }));
  add("copy for encoding ms", best_ms([&] { queue.copy(robot.content); }));
  add("encode a record ms", best_ms([&] { (void)wire::encode_keyframe(record); }));
  add("cut into messages ms", best_ms([&] {
        wire::EncodedKeyframe keyframe{record.session, record.sequence, 0, payload};
        (void)lcm_port::cut_into_messages(keyframe, lcm_port::kLargestDatagramBytes);
      }));
  add("decode ms", best_ms([&] { (void)wire::decode_keyframe(payload); }));
  add("zlib level 1 ms", best_ms([&] { fast = deflated(payload, 1); }));
  add("zlib level 1 bytes", static_cast<double>(fast.size()));
  add("zlib level 6 ms", best_ms([&] { small = deflated(payload, 6); }));
  add("zlib level 6 bytes", static_cast<double>(small.size()));
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> logs;
  CLI::App app{"What keyframes cost on the wire: bytes and milliseconds."};
  app.add_option("LOG", logs, "RUN/keyframes.lcmlog")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<Column> columns;
    for (const std::string& log : logs) {
      for (const SessionData& session : lcm_port::read_event_log(log).sessions) {
        for (const KeyframeRecord& record : session.keyframes) measure(record, columns);
      }
    }
    if (columns.empty()) {
      std::fprintf(stderr, "no keyframes in these logs\n");
      return 2;
    }
    std::printf("%zu keyframes\n%-24s %12s %12s\n", columns[0].values.size(), "", "median", "max");
    for (Column& column : columns) {
      const std::span values(column.values);
      std::printf("%-24s %12.3f %12.3f\n", column.name, median(values), quantile(values, 1.0));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
