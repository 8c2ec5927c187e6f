// Free space of one keyframe: sent images, and the image painted without them
#include "src/merge/sessions/keyframe_free_space.hpp"

#include "src/core/image_code.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

enum class Seen { kUnknown, kOccupied, kFree };

std::int32_t log_odds(const KeyframeFreeSpace& space, const Eigen::Vector3f& point,
                      const Pose& T_keyframe_points = {}) {
  PointEvidence points;
  points.push_back(point);
  space.observe(VisibilityTest(0.6F, 0.0F), EvidenceWeights{}, T_keyframe_points, points.points());
  return points.log_odds(0);
}

Seen look(const KeyframeRecord& keyframe, const Eigen::Vector3f& point,
          WithoutImages without = WithoutImages::kPaintFromCells) {
  const std::int32_t sum = log_odds(KeyframeFreeSpace(keyframe, without), point);
  return sum > 0 ? Seen::kFree : sum < 0 ? Seen::kOccupied : Seen::kUnknown;
}

KeyframeRecord before_a_wall() {
  KeyframeRecord keyframe;
  for (float y = -8.0F; y <= 8.0F; y += 0.2F) {
    for (float z = -2.0F; z <= 4.0F; z += 0.2F) {
      keyframe.static_cells.push_back({Eigen::Vector3f(12.0F, y, z), 3, 0, 0});
    }
  }
  return keyframe;
}

constexpr RangeImageShape kShape{90.0F, 1.0F, -45.0F, 45.0F, 1.0F};

/// Every direction of the sensor was free up to `range_m`.
CodedImage image_up_to(float range_m, std::uint32_t scan) {
  const std::vector<std::uint16_t> pixels(
      ImageProjection(kShape).pixels(), static_cast<std::uint16_t>(range_m * kRangeUnitsPerMetre));
  CodedImage image{scan, std::vector<std::uint8_t>(max_image_code(pixels.size()))};
  image.code.resize(encode_image(pixels, image.code));
  return image;
}

/// Sensors ahead of each other by a metre, each with an image up to 10 m.
KeyframeRecord with_images(std::uint32_t count) {
  KeyframeRecord keyframe;
  keyframe.image_shape = kShape;
  keyframe.T_odometry_keyframe.translation = {100.0, -50.0, 3.0};
  for (std::uint32_t i = 0; i < count; ++i) {
    KeyframeScan scan{i, 0, keyframe.T_odometry_keyframe};
    scan.T_odometry_sensor.translation.x() += static_cast<double>(i);
    keyframe.scans.push_back(scan);
    keyframe.images.push_back(image_up_to(10.0F, i));
  }
  return keyframe;
}

}  // namespace

TEST_CASE("In front of a wall is free, at it occupied, behind it and beside it unknown",
          "[free space]") {
  const KeyframeRecord keyframe = before_a_wall();
  CHECK(look(keyframe, {8.0F, 0.0F, 0.5F}) == Seen::kFree);
  CHECK(look(keyframe, {12.1F, 0.0F, 0.5F}) == Seen::kOccupied);
  CHECK(look(keyframe, {15.0F, 0.0F, 0.5F}) == Seen::kUnknown);
  CHECK(look(keyframe, {-8.0F, 0.0F, 0.5F}) == Seen::kUnknown);
  CHECK(look(keyframe, {8.0F, 0.0F, 30.0F}) == Seen::kUnknown);
}

TEST_CASE("A dynamic object occludes the structure behind it", "[free space]") {
  KeyframeRecord keyframe = before_a_wall();
  for (const FineCell& cell : keyframe.static_cells) {
    const Eigen::Vector3f p(4.0F, 0.4F * cell.position.y(), 0.4F * cell.position.z());
    keyframe.dynamic_cells.push_back({p, 3, 0, 0});
  }
  CHECK(look(keyframe, {8.0F, 0.0F, 0.5F}) == Seen::kUnknown);
  CHECK(look(keyframe, {2.0F, 0.0F, 0.1F}) == Seen::kFree);
}

TEST_CASE("Without images nothing is known unless an image is to be painted from the cells",
          "[free space]") {
  const KeyframeRecord keyframe = before_a_wall();
  CHECK(look(keyframe, {8.0F, 0.0F, 0.5F}, WithoutImages::kUnknown) == Seen::kUnknown);
  CHECK(KeyframeFreeSpace(keyframe, WithoutImages::kUnknown).empty());
  CHECK_FALSE(KeyframeFreeSpace(keyframe, WithoutImages::kPaintFromCells).empty());
}

TEST_CASE("Sent images are used from where their scans were taken, and cells are not",
          "[free space]") {
  KeyframeRecord keyframe = with_images(2);
  keyframe.static_cells = before_a_wall().static_cells;
  const KeyframeFreeSpace space(keyframe, WithoutImages::kPaintFromCells);
  // Free up to 10 m from the first sensor and 11 m from the second one.
  const std::int32_t free = EvidenceWeights{}.free;
  const std::int32_t surface = EvidenceWeights{}.weakly_occupied;
  CHECK(log_odds(space, {5.0F, 0.0F, 0.0F}) == 2 * free);
  CHECK(log_odds(space, {9.9F, 0.0F, 0.0F}) == free - surface);
  CHECK(log_odds(space, {10.5F, 0.0F, 0.0F}) == -2 * surface);
  CHECK(log_odds(space, {11.5F, 0.0F, 0.0F}) == -surface);
  CHECK(log_odds(space, {11.7F, 0.0F, 0.0F}) == 0);
  const Pose behind(Eigen::Matrix3d::Identity(), {-10.0, 0.0, 0.0});
  CHECK(log_odds(space, {15.0F, 0.0F, 0.0F}, behind) == 2 * free);
}

TEST_CASE("More than two images of a keyframe weigh as much as two", "[free space]") {
  const auto at = [](float x, std::uint32_t images) {
    return log_odds(KeyframeFreeSpace(with_images(images), WithoutImages::kUnknown),
                    {x, 0.0F, 0.0F});
  };
  const std::int32_t free = EvidenceWeights{}.free;
  CHECK(at(8.0F, 1) == free);
  CHECK(at(8.0F, 2) == 2 * free);
  CHECK(at(8.0F, 4) == 2 * free);
  CHECK(at(8.0F, 5) == 2 * free);
  CHECK(at(9.5F, 4) < 2 * free);  // free for all but the first
}

TEST_CASE("Damaged images, and those of scans that are not there, are left out", "[free space]") {
  KeyframeRecord keyframe = with_images(2);
  keyframe.images[0].code.resize(keyframe.images[0].code.size() / 2);
  CHECK(log_odds(KeyframeFreeSpace(keyframe, WithoutImages::kUnknown), {5.0F, 0.0F, 0.0F}) ==
        EvidenceWeights{}.free);
  keyframe.images[1].scan = 2;
  CHECK(KeyframeFreeSpace(keyframe, WithoutImages::kUnknown).empty());
  // Images were sent: what the cells would tell is not taken for them.
  CHECK(KeyframeFreeSpace(keyframe, WithoutImages::kPaintFromCells).empty());
}

TEST_CASE("The field of view is the share of all directions with a range", "[free space]") {
  // A quarter of a turn, and 0.7071 of the sine's range to either side.
  const KeyframeFreeSpace space(with_images(1), WithoutImages::kUnknown);
  CHECK(space.field_of_view() == Approx(0.25 * 0.70711).epsilon(1e-4));
  CHECK(KeyframeFreeSpace(KeyframeRecord{}, WithoutImages::kUnknown).field_of_view() == 0.0);
}
