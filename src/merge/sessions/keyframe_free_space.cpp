#include "keyframe_free_space.hpp"

#include <algorithm>

#include "src/core/image_code.hpp"
#include "src/merge/heap_memory.hpp"
#include "unimapper/core/angles.hpp"
#include "unimapper/free_space/range_image.hpp"

namespace unimapper::merge {
namespace {

constexpr float kImagesInFull = 2.0F;  ///< of a keyframe that count as independent

/// Pixels that the cells of every LiDAR fill: of nine neighbours, two thirds must hold a cell.
constexpr RangeImageShape kPaintedShape{360.0F, 1.5F, -60.0F, 60.0F, 1.5F};
constexpr std::uint32_t kPaintedMinReturns = 6;
constexpr float kPaintedRangeMinM = 0.1F;
constexpr float kPaintedRangeMaxM = 500.0F;

EvidenceWeights scaled(const EvidenceWeights& weights, float factor) {
  const auto scale = [&](std::int32_t weight) {
    return static_cast<std::int32_t>(static_cast<float>(weight) * factor + 0.5F);
  };
  return {scale(weights.free), scale(weights.occupied), scale(weights.weakly_occupied)};
}

}  // namespace

KeyframeFreeSpace::KeyframeFreeSpace(const KeyframeRecord& keyframe, WithoutImages without) {
  decode(keyframe);
  if (keyframe.images.empty() && without == WithoutImages::kPaintFromCells) paint(keyframe);
}

void KeyframeFreeSpace::decode(const KeyframeRecord& keyframe) {
  if (keyframe.images.empty() || !is_image_shape(keyframe.image_shape)) return;
  shape_ = keyframe.image_shape;
  projection_ = ImageProjection(shape_);
  full_weight_range_m_ = keyframe.image_full_weight_range_m;
  const Pose T_keyframe_odometry = keyframe.T_odometry_keyframe.inverse();
  for (const CodedImage& coded : keyframe.images) {
    if (coded.scan >= keyframe.scans.size()) continue;
    Image image{T_keyframe_odometry * keyframe.scans[coded.scan].T_odometry_sensor,
                std::vector<std::uint16_t>(projection_.pixels())};
    if (decode_image(coded.code, image.pixels)) images_.push_back(std::move(image));
  }
}

/// From static and dynamic cells alike: what moved hid what was behind it.
void KeyframeFreeSpace::paint(const KeyframeRecord& keyframe) {
  std::vector<Eigen::Vector3f> points;
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    for (const FineCell& cell : *cells) points.push_back(cell.position);
  }
  HeapMemory memory;
  RangePainter painter;
  painter.allocate(memory, {kPaintedShape, kPaintedRangeMinM, kPaintedRangeMaxM, kPaintedMinReturns,
                            points.size()});
  shape_ = kPaintedShape;
  projection_ = painter.projection();
  images_.push_back({Pose{}, std::vector<std::uint16_t>(projection_.pixels())});
  painter.paint(PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f)),
                images_.back().pixels.data());
}

void KeyframeFreeSpace::observe(const VisibilityTest& visibility, const EvidenceWeights& weights,
                                const Pose& T_keyframe_points, const ObservedPoints& points) const {
  if (images_.empty()) return;
  const float factor = std::min(1.0F, kImagesInFull / static_cast<float>(images_.size()));
  const InverseSensorModel model(visibility, scaled(weights, factor), full_weight_range_m_);
  for (const Image& image : images_) {
    const Pose T_sensor_points = image.T_keyframe_sensor.inverse() * T_keyframe_points;
    model.add(image.pixels.data(), projection_, T_sensor_points.rotation.cast<float>(),
              T_sensor_points.translation.cast<float>(), points);
  }
}

double KeyframeFreeSpace::field_of_view() const {
  if (images_.empty()) return 0.0;
  std::size_t known = 0;
  for (const Image& image : images_) {
    known += image.pixels.size() - static_cast<std::size_t>(std::count(
                                       image.pixels.begin(), image.pixels.end(), kNoRange));
  }
  // Every pixel covers the same solid angle: rows are even in the sine of the elevation.
  const double share =
      static_cast<double>(known) / static_cast<double>(images_.size() * projection_.pixels());
  return share * static_cast<double>(shape_.horizontal_fov_deg) / 360.0 * 0.5 *
         (sin_deg(shape_.elevation_max_deg) - sin_deg(shape_.elevation_min_deg));
}

}  // namespace unimapper::merge
