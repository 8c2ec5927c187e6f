// Point cloud of a survey: a static map in a frame of its own.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/ids.hpp"

namespace unimapper::apps {

/// Points of a survey, metres in its frame, z up; at most one per 0.1 m.
struct SurveyCloud {
  std::vector<Eigen::Vector3f> points;  ///< in ascending order of their cubes
  std::uint64_t not_finite = 0;         ///< points of the file that were left out
  SessionId id;                         ///< follows from the bytes of the file alone
};

/// The cloud in the bytes of a PLY or PCD file, by the extension of `file`, which names it in
/// errors. Throws std::runtime_error in words: what is damaged (`parse_ply`, `parse_pcd`), another
/// format, fewer than 1000 finite points, an extent of less than 5 m, coordinates of 16 km and
/// more, which single precision does not hold to a millimetre.
SurveyCloud parse_survey(std::string_view bytes, const std::filesystem::path& file);

/// The points of a cloud by place.
class PointTiles {
 public:
  explicit PointTiles(std::vector<Eigen::Vector3f> points);

  /// Calls `take` with every point in the tiles that a circle about `center` touches, in the same
  /// order each time. O(points there).
  template <typename Take>
  void for_each_near(const Eigen::Vector2f& center, float radius_m, const Take& take) const {
    const auto [low_x, low_y] = tile_of(center.x() - radius_m, center.y() - radius_m);
    const auto [high_x, high_y] = tile_of(center.x() + radius_m, center.y() + radius_m);
    for (std::int32_t x = low_x; x <= high_x; ++x) {
      const std::size_t end = first_from({x, high_y + 1});
      for (std::size_t i = first_from({x, low_y}); i < end; ++i) take(points_[i]);
    }
  }
  [[nodiscard]] const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  using Tile = std::pair<std::int32_t, std::int32_t>;
  static Tile tile_of(float x, float y);
  [[nodiscard]] std::size_t first_from(const Tile& tile) const;

  std::vector<Eigen::Vector3f> points_;               ///< by tile
  std::vector<std::pair<Tile, std::size_t>> firsts_;  ///< of each tile that has points
};

}  // namespace unimapper::apps
