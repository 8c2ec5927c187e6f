#include "src/apps/survey/survey_cloud.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/ply.hpp"

namespace unimapper::apps {
namespace {

constexpr float kPointSpacingM = 0.1F;
constexpr float kTileM = 8.0F;
constexpr std::size_t kFewestPoints = 1000;
constexpr float kSmallestExtentM = 5.0F;
constexpr float kLargestCoordinateM = 16000.0F;

/// FNV-1a, 64 bits. No cryptographic hash: names a file, and proves nothing of who made it.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t start) {
  std::uint64_t hash = start;
  for (const char byte : bytes) {
    hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001B3ULL;
  }
  return hash;
}

/// A robot's number that random ones hardly ever have, with the content as its start.
SessionId identity_of(std::string_view bytes) {
  constexpr std::uint32_t kSurveys = 0x53565259;  // "SVRY"
  return {kSurveys, {hash_of(bytes, 0xCBF29CE484222325ULL), hash_of(bytes, 0x9E3779B97F4A7C15ULL)}};
}

void read_points(std::string_view bytes, const std::filesystem::path& file, datasets::Scan& scan) {
  const std::string extension = datasets::lower_case(file.extension().string());
  if (extension == ".ply") {
    datasets::parse_ply(bytes, file, scan);
  } else if (extension == ".pcd") {
    (void)datasets::parse_pcd(bytes, file, scan);
  } else {
    datasets::fail(file, "a survey is a PLY or PCD file");
  }
}

std::string metres_text(float metres) { return fmt::format("{:.1f} m", metres); }

void check_extent(const std::vector<Eigen::Vector3f>& points, const std::filesystem::path& file) {
  if (points.size() < kFewestPoints) {
    datasets::fail(file, "has " + std::to_string(points.size()) + " finite points, a survey " +
                             std::to_string(kFewestPoints) + " at least");
  }
  Eigen::Array3f low = points.front().array();
  Eigen::Array3f high = low;
  for (const Eigen::Vector3f& point : points) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  if (low.abs().max(high.abs()).maxCoeff() > kLargestCoordinateM) {
    datasets::fail(file, "has coordinates of " + metres_text(low.abs().max(high.abs()).maxCoeff()) +
                             ", which single precision does not hold: subtract whole kilometres "
                             "first, or convert millimetres to metres");
  }
  const float extent = std::max(high.x() - low.x(), high.y() - low.y());
  if (extent < kSmallestExtentM) {
    datasets::fail(file, "extends over " + metres_text(extent) + ", a survey over " +
                             metres_text(kSmallestExtentM) + " at least; are its units metres?");
  }
}

std::int32_t cell(float coordinate, float size) {
  return static_cast<std::int32_t>(std::floor(coordinate / size));
}

/// Of each cube the first point.
std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& points) {
  using Cube = std::tuple<std::int32_t, std::int32_t, std::int32_t, std::size_t>;
  std::vector<Cube> cubes;
  cubes.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    cubes.emplace_back(cell(points[i].x(), kPointSpacingM), cell(points[i].y(), kPointSpacingM),
                       cell(points[i].z(), kPointSpacingM), i);
  }
  std::sort(cubes.begin(), cubes.end());
  std::vector<Eigen::Vector3f> kept;
  for (std::size_t i = 0; i < cubes.size(); ++i) {
    const auto& [x, y, z, point] = cubes[i];
    const bool is_same = i > 0 && std::get<0>(cubes[i - 1]) == x &&
                         std::get<1>(cubes[i - 1]) == y && std::get<2>(cubes[i - 1]) == z;
    if (!is_same) kept.push_back(points[point]);
  }
  return kept;
}

}  // namespace

SurveyCloud parse_survey(std::string_view bytes, const std::filesystem::path& file) {
  datasets::Scan scan;
  read_points(bytes, file, scan);
  SurveyCloud cloud;
  std::vector<Eigen::Vector3f> points;
  points.reserve(scan.points.size());
  for (const datasets::Scan::Point& point : scan.points) {
    const Eigen::Vector3f p(point.x, point.y, point.z);
    if (p.allFinite()) points.push_back(p);
  }
  cloud.not_finite = scan.points.size() - points.size();
  scan = {};
  check_extent(points, file);
  cloud.points = thinned(points);
  cloud.id = identity_of(bytes);
  return cloud;
}

PointTiles::Tile PointTiles::tile_of(float x, float y) {
  return {cell(x, kTileM), cell(y, kTileM)};
}

PointTiles::PointTiles(std::vector<Eigen::Vector3f> points) : points_(std::move(points)) {
  std::stable_sort(points_.begin(), points_.end(), [](const auto& a, const auto& b) {
    return tile_of(a.x(), a.y()) < tile_of(b.x(), b.y());
  });
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Tile tile = tile_of(points_[i].x(), points_[i].y());
    if (firsts_.empty() || firsts_.back().first != tile) firsts_.emplace_back(tile, i);
  }
}

std::size_t PointTiles::first_from(const Tile& tile) const {
  const auto found =
      std::lower_bound(firsts_.begin(), firsts_.end(), tile,
                       [](const auto& first, const Tile& wanted) { return first.first < wanted; });
  return found == firsts_.end() ? points_.size() : found->second;
}

}  // namespace unimapper::apps
