// Tests of the queue of keyframe copies: order, full queue, two threads.
#include "unimapper/wire/keyframe_queue.hpp"

#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::wire;

namespace {

constexpr KeyframeRoom kRoom{4, 50, 5, 2, 30};
using Queue = Owned<KeyframeQueue>;

/// A keyframe whose every element tells its number, in memory of its own.
struct Source {
  std::vector<KeyframeScan> scans;
  std::vector<FineCell> static_cells;
  std::vector<FineCell> dynamic_cells;
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  std::vector<std::uint16_t> pixels;
  std::vector<FreeSpaceImage> images;
  KeyframeContent content;

  explicit Source(std::uint32_t number, std::size_t cells = 20) {
    const auto value = static_cast<float>(number);
    scans.assign(3, {number, 7, Pose{}});
    static_cells.assign(cells, {{value, 1.0F, 2.0F}, 3, 1, 0});
    dynamic_cells.assign(10, {{value, 4.0F, 5.0F}, 6, 0, 0});
    keypoints.assign(5, {{value, 0.0F, 0.0F}, {0.0F, 0.0F, 1.0F}, number, 2});
    planes.assign(2, {});
    pixels.assign(30, static_cast<std::uint16_t>(number));
    images.assign(2, {number % 3, pixels});
    content.sequence = number;
    content.scans = scans;
    content.static_cells = static_cells;
    content.dynamic_cells = dynamic_cells;
    content.place.keypoints = keypoints;
    content.place.planes = planes;
    content.images = images;
    content.points_in = number;
  }
};

/// Whether a copy is whole: of one keyframe in all its parts, and in memory of its own.
bool is_copy_of(const KeyframeContent& copy, std::uint32_t number, std::size_t cells = 20) {
  const auto all = [](const auto& list, std::size_t size, const auto& is_right) {
    return list.size() == size && std::all_of(list.begin(), list.end(), is_right);
  };
  const auto value = static_cast<float>(number);
  const Eigen::Vector3f standing(value, 1.0F, 2.0F);
  const Eigen::Vector3f moving(value, 4.0F, 5.0F);
  return copy.sequence == number && copy.points_in == number && copy.place.planes.empty() &&
         all(copy.scans, 3, [&](const auto& scan) { return scan.scan_index == number; }) &&
         all(copy.static_cells, cells,
             [&](const auto& cell) { return cell.position == standing && cell.ground == 1; }) &&
         all(copy.dynamic_cells, 10,
             [&](const auto& cell) { return cell.position == moving && cell.points == 6; }) &&
         all(copy.place.keypoints, 5, [&](const auto& k) { return k.occupancy == number; }) &&
         all(copy.images, 2, [&](const FreeSpaceImage& image) {
           const auto pixel = static_cast<std::uint16_t>(number);
           return image.scan == number % 3 &&
                  all(image.pixels, 30, [&](const auto& p) { return p == pixel; });
         });
}

}  // namespace

TEST_CASE("copies come out in order, and do not depend on what was copied") {
  Queue queue(kRoom, std::uint32_t{3});
  REQUIRE(queue.ok());
  CHECK(queue->front() == nullptr);
  for (std::uint32_t i = 0; i < 3; ++i) {
    Source source(i);
    CHECK(queue->push(source.content, false) == HandedOver::kQueued);
    source.static_cells.assign(20, {});
    source.pixels.assign(30, 999);
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    REQUIRE(queue->front() != nullptr);
    CHECK(is_copy_of(*queue->front(), i));
    queue->pop();
  }
  CHECK(queue->front() == nullptr);
  queue->pop();  // of nothing
  CHECK(queue->front() == nullptr);
}

TEST_CASE("a full queue refuses, or drops the oldest that is not being read") {
  Queue queue(kRoom, std::uint32_t{3});
  for (std::uint32_t i = 0; i < 3; ++i) (void)queue->push(Source(i).content, false);
  CHECK(queue->push(Source(3).content, false) == HandedOver::kFull);
  REQUIRE(queue->front() != nullptr);  // 0 is being read
  CHECK(queue->push(Source(4).content, true) == HandedOver::kReplacedOldest);
  CHECK(is_copy_of(*queue->front(), 0));
  queue->pop();
  for (const std::uint32_t expected : {2U, 4U}) {
    REQUIRE(queue->front() != nullptr);
    CHECK(is_copy_of(*queue->front(), expected));
    queue->pop();
  }
  CHECK(queue->front() == nullptr);
}

TEST_CASE("a keyframe larger than a slot is refused, in any of its lists, and disturbs nothing") {
  Queue queue(kRoom, std::uint32_t{2});
  const auto refuses = [&](const std::function<void(Source&)>& spoil) {
    Source source(1);
    spoil(source);
    CHECK(queue->push(source.content, true) == HandedOver::kTooLarge);
  };
  CHECK(queue->push(Source(0, 40).content, true) == HandedOver::kQueued);
  refuses([](Source& s) { s.content.static_cells = s.static_cells = std::vector<FineCell>(41); });
  refuses([](Source& s) { s.content.scans = s.scans = std::vector<KeyframeScan>(5); });
  refuses([](Source& s) { s.content.place.keypoints = s.keypoints = std::vector<Keypoint>(6); });
  refuses([](Source& s) { s.content.images = s.images = std::vector<FreeSpaceImage>(3); });
  refuses([](Source& s) {
    s.pixels.assign(31, 0);
    s.images[1].pixels = s.pixels;
  });
  CHECK(is_copy_of(*queue->front(), 0, 40));
}

TEST_CASE("between two threads every keyframe comes out whole and in order") {
  for (const bool drops : {false, true}) {
    Queue queue(kRoom, std::uint32_t{3});
    constexpr std::uint32_t kKeyframes = 3000;
    std::atomic<bool> done{false};
    std::uint32_t torn = 0;
    std::uint32_t read = 0;
    std::int64_t last = -1;
    bool ordered = true;
    std::thread reader([&] {
      while (true) {
        const bool over = done;
        const KeyframeContent* const copy = queue->front();
        if (copy == nullptr) {
          if (over) return;
          std::this_thread::yield();
          continue;
        }
        torn += is_copy_of(*copy, copy->sequence) ? 0 : 1;
        ordered = ordered && copy->sequence > last;
        last = copy->sequence;
        ++read;
        queue->pop();
      }
    });
    std::uint32_t dropped = 0;
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      const Source source(i);
      HandedOver result = queue->push(source.content, drops);
      while (result == HandedOver::kFull) {
        CHECK_FALSE(drops);
        std::this_thread::yield();
        result = queue->push(source.content, drops);
      }
      dropped += result == HandedOver::kReplacedOldest ? 1 : 0;
    }
    done = true;
    reader.join();
    CHECK(torn == 0);
    CHECK(ordered);
    CHECK(read + dropped == kKeyframes);
    CHECK(last == kKeyframes - 1);
  }
}
