// Scenes of upright sheets, seen by a robot that stands at the origin
#pragma once

#include "src/core/image_code.hpp"
#include "src/core/voxel_key.hpp"
#include "tests/test.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge::testing {

/// An upright rectangle across the robot's view, as points a few centimetres apart.
struct Sheet {
  float x;
  float y_min, y_max;
  float z_min, z_max;

  [[nodiscard]] std::vector<Eigen::Vector3f> points() const {
    std::vector<Eigen::Vector3f> points;
    for (float y = y_min; y <= y_max; y += 0.04F) {
      for (float z = z_min; z <= z_max; z += 0.04F) points.emplace_back(x, y, z);
    }
    return points;
  }
};

inline const Sheet kWall{12.1F, -6.0F, 6.0F, -2.0F, 3.0F};
inline const Sheet kPerson{6.1F, -0.3F, 0.3F, -1.2F, 0.6F};

inline std::vector<FineCell> cells_of(const Sheet& sheet) {
  std::map<std::array<int, 3>, std::pair<Eigen::Vector3f, int>> sums;
  for (const Eigen::Vector3f& p : sheet.points()) {
    const VoxelIndex at = voxel_index(p, 5.0F);
    auto& [sum, count] =
        sums.try_emplace({at.x, at.y, at.z}, Eigen::Vector3f::Zero(), 0).first->second;
    sum += p;
    ++count;
  }
  std::vector<FineCell> cells;
  for (const auto& [at, entry] : sums) {
    cells.push_back({entry.first / static_cast<float>(entry.second),
                     static_cast<std::uint16_t>(entry.second), 0, 0});
  }
  return cells;
}

/// How far one sees from the origin if there is nothing but `sheets`.
inline std::vector<std::uint8_t> image_of(const RangeImageShape& shape,
                                          const std::vector<Sheet>& sheets) {
  const ImageProjection projection(shape);
  std::vector<std::uint16_t> pixels(projection.pixels(), 0);
  for (const Sheet& sheet : sheets) {
    for (const Eigen::Vector3f& p : sheet.points()) {
      std::int32_t pixel = 0;
      float range_m = 0.0F;
      projection.project(&p.x(), &p.y(), &p.z(), 1, &pixel, &range_m);
      if (pixel == ImageProjection::kOutside) continue;
      auto& nearest = pixels[static_cast<std::size_t>(pixel)];
      const auto units = static_cast<std::uint16_t>(range_m * kRangeUnitsPerMetre);
      nearest = nearest == 0 ? units : std::min(nearest, units);
    }
  }
  std::vector<std::uint8_t> code(max_image_code(pixels.size()));
  code.resize(encode_image(pixels, code));
  return code;
}

/// What a robot that stands at the origin makes of `kept` and `removed`.
inline KeyframeRecord keyframe_of(std::uint32_t sequence, const std::vector<Sheet>& kept,
                                  const std::vector<Sheet>& removed = {}) {
  KeyframeRecord keyframe;
  keyframe.sequence = sequence;
  keyframe.scans.resize(1);
  keyframe.image_shape = {120.0F, 1.0F, -40.0F, 40.0F, 1.0F};
  std::vector<Sheet> all = kept;
  all.insert(all.end(), removed.begin(), removed.end());
  keyframe.images = {{0, image_of(keyframe.image_shape, all)}};
  for (const Sheet& sheet : kept) {
    for (const FineCell& cell : cells_of(sheet)) keyframe.static_cells.push_back(cell);
  }
  for (const Sheet& sheet : removed) {
    for (const FineCell& cell : cells_of(sheet)) keyframe.dynamic_cells.push_back(cell);
  }
  return keyframe;
}

}  // namespace unimapper::merge::testing
