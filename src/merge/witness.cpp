#include "witness.hpp"

#include <algorithm>

#include "unimapper/core/image_code.hpp"

namespace unimapper::merge {
namespace {

constexpr float kImagesPerKeyframe = 2.0F;  ///< that count in full
constexpr std::size_t kPointsPerBatch = 256;

}  // namespace

Witness::Witness(const PlacedSession& placed, std::size_t keyframe) {
  const KeyframeRecord& record = placed.session->keyframes[keyframe];
  if (record.images.empty() || !is_image_shape(record.image_shape)) return;
  projection_ = ImageProjection(record.image_shape);
  full_weight_range_m_ = record.image_full_weight_range_m;
  const Pose T_map_odometry =
      placed.T_map_keyframe[keyframe] * record.T_odometry_keyframe.inverse();
  for (const CodedImage& coded : record.images) {
    if (coded.scan >= record.scans.size()) continue;
    Image image{(T_map_odometry * record.scans[coded.scan].T_odometry_sensor).inverse(),
                std::vector<std::uint16_t>(projection_.pixels())};
    if (decode_image(coded.code, image.pixels)) images_.push_back(std::move(image));
  }
}

float Witness::verdict(std::uint16_t pixel, float range_m, const RefinementConfig& config) const {
  if (pixel == kNoRange) return 0.0F;
  const float seen_m = static_cast<float>(pixel) / kRangeUnitsPerMetre;
  const float margin_m = config.range_margin_m + range_m * config.range_margin_relative;
  if (seen_m > range_m + margin_m) {
    const bool is_sure = !(full_weight_range_m_ > 0.0F) || range_m <= full_weight_range_m_;
    return is_sure ? config.log_odds_free : config.log_odds_free * full_weight_range_m_ / range_m;
  }
  return seen_m > range_m - margin_m ? -config.log_odds_weakly_occupied : 0.0F;
}

void Witness::judge(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& origin,
                    const RefinementConfig& config, std::span<float> log_odds) const {
  if (images_.empty()) return;
  const float scale = std::min(1.0F, kImagesPerKeyframe / static_cast<float>(images_.size()));
  for (const Image& image : images_) judge(image, points, origin, config, scale, log_odds);
}

void Witness::judge(const Image& image, std::span<const Eigen::Vector3f> points,
                    const Eigen::Vector3d& origin, const RefinementConfig& config, float scale,
                    std::span<float> log_odds) const {
  const Eigen::Matrix3f r = image.T_sensor_map.rotation.cast<float>();
  const Eigen::Vector3f t = (image.T_sensor_map * origin).cast<float>();
  float x[kPointsPerBatch];
  float y[kPointsPerBatch];
  float z[kPointsPerBatch];
  float range_m[kPointsPerBatch];
  std::int32_t pixel[kPointsPerBatch];
  for (std::size_t first = 0; first < points.size(); first += kPointsPerBatch) {
    const std::size_t size = std::min(kPointsPerBatch, points.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector3f p = r * points[first + i] + t;
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
    projection_.project(x, y, z, size, pixel, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      if (pixel[i] == ImageProjection::kOutside) continue;
      const std::uint16_t seen = image.pixels[static_cast<std::size_t>(pixel[i])];
      log_odds[first + i] += scale * verdict(seen, range_m[i], config);
    }
  }
}

}  // namespace unimapper::merge
