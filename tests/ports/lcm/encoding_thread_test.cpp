// Tests of the thread that encodes keyframes.
#include "ports/lcm/encoding_thread.hpp"

#include <future>

#include "tests/test.hpp"
#include "tests/wire/records.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;

namespace {

constexpr SessionId kSession{3, 4};

/// A keyframe in memory, of one record.
struct Source {
  KeyframeRecord record;
  KeyframeContent content;

  explicit Source(std::uint32_t sequence) : record(wire_test::random_record(sequence + 1, 300)) {
    record.session = kSession;
    record.sequence = sequence;
    content.sequence = sequence;
    content.reference_scan = record.reference_scan;
    content.T_odometry_keyframe = record.T_odometry_keyframe;
    content.scans = record.scans;
    content.cell_size_m = record.cell_size_m;
    content.static_cells = record.static_cells;
    content.dynamic_cells = record.dynamic_cells;
    content.place.keypoints = record.keypoints;
  }
};

EncodingOptions options_of(bool drop_when_full) {
  return {{100, 2000, 500, 2, 10000}, 3, drop_when_full};
}

/// What the encoder itself makes of it.
std::vector<std::uint8_t> encoded(const Source& source) {
  MemoryBlock memory(KeyframeEncoder::required_bytes(2000));
  KeyframeEncoder encoder = KeyframeEncoder::create(2000, memory.span()).value();
  std::vector<std::uint8_t> bytes(std::size_t{1} << 20U);
  bytes.resize(encoder.encode(source.content, kSession, bytes).bytes);
  return bytes;
}

}  // namespace

TEST_CASE("a pipeline that may wait waits, and its keyframes are handed on in order") {
  std::vector<EncodedKeyframe> taken;
  EncodingThread thread(kSession, options_of(false), [&](EncodedKeyframe keyframe) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    taken.push_back(std::move(keyframe));
  });
  for (std::uint32_t i = 0; i < 20; ++i) {
    CHECK(thread.hand_over(Source(i).content) == HandedOver::kQueued);
  }
  const EncodingCounters counters = thread.finish();
  CHECK(counters.handed_over == 20);
  CHECK(counters.encoded == 20);
  CHECK(counters.dropped == 0);
  REQUIRE(taken.size() == 20);
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < 20; ++i) {
    const Source source(i);
    CHECK(taken[i].session == kSession);
    CHECK(taken[i].sequence == i);
    CHECK(taken[i].stamp_ns == source.record.scans.back().stamp_ns);
    CHECK(taken[i].bytes == encoded(source));
    bytes += taken[i].bytes.size();
  }
  CHECK(counters.bytes == bytes);
}

TEST_CASE("a pipeline that must not wait drops the oldest keyframe of a full queue") {
  std::promise<void> begun;
  std::promise<void> go_on;
  std::vector<std::uint32_t> taken;
  EncodingThread thread(kSession, options_of(true), [&](const EncodedKeyframe& keyframe) {
    if (taken.empty()) {
      begun.set_value();
      go_on.get_future().wait();
    }
    taken.push_back(keyframe.sequence);
  });
  (void)thread.hand_over(Source(0).content);
  begun.get_future().wait();
  for (std::uint32_t i = 1; i < 6; ++i) (void)thread.hand_over(Source(i).content);
  go_on.set_value();
  const EncodingCounters counters = thread.finish();
  CHECK(counters.handed_over == 6);
  CHECK(counters.dropped == 3);
  CHECK(counters.encoded == 3);
  CHECK(taken == std::vector<std::uint32_t>{0, 4, 5});
}

TEST_CASE("what the taker throws reaches the pipeline's thread, which is not blocked") {
  EncodingThread thread(kSession, options_of(false), [](const EncodedKeyframe& keyframe) {
    if (keyframe.sequence == 1) throw std::runtime_error("disk full");
  });
  for (std::uint32_t i = 0; i < 20; ++i) (void)thread.hand_over(Source(i).content);
  CHECK_THROWS_WITH(thread.finish(), "disk full");
  CHECK_THROWS_WITH(thread.rethrow(), "disk full");
}

TEST_CASE("a keyframe that cannot be encoded is counted, and the next one is encoded") {
  std::vector<std::uint32_t> taken;
  EncodingThread thread(kSession, options_of(false), [&](const EncodedKeyframe& keyframe) {
    taken.push_back(keyframe.sequence);
  });
  Source without_scans(0);
  without_scans.content.scans = {};
  (void)thread.hand_over(without_scans.content);
  (void)thread.hand_over(Source(1).content);
  CHECK(thread.finish().refused == 1);
  CHECK(taken == std::vector<std::uint32_t>{1});
}
