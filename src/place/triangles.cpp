#include "triangles.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "column_code.hpp"
#include "src/core/voxel_key.hpp"
#include "unimapper/core/angles.hpp"

namespace unimapper::place {
namespace {

constexpr std::uint32_t kMaxKeypoints = 255;
constexpr std::uint32_t kMaxNeighbours = 32;
// Flatter triangles have no reliable orientation; measured.
constexpr float kMinTriangleHeightM = 1.0F;

// The k nearest neighbours of every keypoint, as lists and as a bit matrix.
struct Neighbourhood {
  std::uint8_t list[kMaxKeypoints][kMaxNeighbours];
  std::uint8_t count[kMaxKeypoints];
  std::uint64_t bits[kMaxKeypoints][4];

  [[nodiscard]] bool contains(std::uint32_t of, std::uint32_t other) const noexcept {
    return ((bits[of][other / 64U] >> (other % 64U)) & 1U) != 0;
  }
};

float squared_distance(const Keypoint& a, const Keypoint& b) noexcept {
  return (a.position - b.position).head<2>().squaredNorm();
}

// Only neighbours far enough away to be a side are counted: larger triangles are rarer, so more
// distinctive, and their headings more accurate.
void find_neighbours(std::span<const Keypoint> keypoints, const TriangleConfig& config,
                     Neighbourhood& result) noexcept {
  const std::uint32_t wanted = std::min(config.neighbours, kMaxNeighbours);
  const float nearest_squared = config.min_side_m * config.min_side_m;
  const float farthest_squared = config.max_side_m * config.max_side_m;
  const auto n = static_cast<std::uint32_t>(keypoints.size());
  float x[kMaxKeypoints];
  float y[kMaxKeypoints];
  for (std::uint32_t i = 0; i < n; ++i) {
    x[i] = keypoints[i].position.x();
    y[i] = keypoints[i].position.y();
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    // Distance above, index below: one comparison orders both, as the bits of positive floats
    // ascend with their values.
    std::uint64_t order[kMaxKeypoints];
    std::uint32_t count = 0;
    for (std::uint32_t j = 0; j < n; ++j) {
      const float dx = x[j] - x[i];
      const float dy = y[j] - y[i];
      const float d = dx * dx + dy * dy;
      order[count] = (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(d)) << 8U) | j;
      count += j != i && d >= nearest_squared && d <= farthest_squared ? 1U : 0U;
    }
    const std::uint32_t kept = std::min(count, wanted);
    std::partial_sort(order, order + kept, order + count);
    result.count[i] = static_cast<std::uint8_t>(kept);
    for (std::uint64_t& word : result.bits[i]) word = 0;
    for (std::uint32_t k = 0; k < kept; ++k) {
      const auto j = static_cast<std::uint32_t>(order[k] & 0xFFU);
      result.list[i][k] = static_cast<std::uint8_t>(j);
      result.bits[i][j / 64U] |= 1ULL << (j % 64U);
    }
  }
}

// True if a vertex of smaller index forms this triangle.
bool formed_by_earlier(const Neighbourhood& near, std::uint32_t i, std::uint32_t j,
                       std::uint32_t k) noexcept {
  return (j < i && near.contains(j, i) && near.contains(j, k)) ||
         (k < i && near.contains(k, i) && near.contains(k, j));
}

std::uint8_t quantised_dot(const Keypoint& a, const Keypoint& b) noexcept {
  const float dot = std::min(1.0F, std::abs(a.normal.dot(b.normal)));
  return static_cast<std::uint8_t>(dot * 255.0F + 0.5F);
}

// Direction of (x, y) in 1/65536 turn.
std::uint16_t heading_of(float x, float y) noexcept {
  const auto steps = static_cast<std::int32_t>(direction_turns(x, y) * 65536.0F);
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(steps) & 0xFFFFU);
}

std::int16_t center_step(float metres) noexcept {
  const float bounded = std::clamp(metres * 100.0F, -32767.0F, 32767.0F);
  return static_cast<std::int16_t>(floor_to_int(bounded + 0.5F));
}

// Sorts the sides and fills the attributes; false if the triangle is refused.
bool make_triangle(std::span<const Keypoint> points, const TriangleConfig& config,
                   const std::uint32_t (&corner)[3], Triangle& out) noexcept {
  struct Side {
    float length;
    std::uint32_t opposite;
  } side[3];
  for (std::uint32_t i = 0; i < 3; ++i) {
    const float d = squared_distance(points[corner[(i + 1) % 3]], points[corner[(i + 2) % 3]]);
    side[i] = {std::sqrt(d), corner[i]};
  }
  const auto shorter = [](const Side& a, const Side& b) {
    return a.length < b.length || (a.length == b.length && a.opposite < b.opposite);
  };
  if (shorter(side[1], side[0])) std::swap(side[0], side[1]);
  if (shorter(side[2], side[1])) std::swap(side[1], side[2]);
  if (shorter(side[1], side[0])) std::swap(side[0], side[1]);
  // Negated so that NaN is refused too.
  if (!(side[0].length >= config.min_side_m && side[2].length <= config.max_side_m)) return false;

  const Keypoint& a = points[side[0].opposite];
  const Keypoint& b = points[side[1].opposite];
  const Keypoint& c = points[side[2].opposite];
  const Eigen::Vector3f ab = b.position - a.position;
  const Eigen::Vector3f ac = c.position - a.position;
  const float doubled_area = ab.x() * ac.y() - ab.y() * ac.x();
  if (!(std::abs(doubled_area) >= kMinTriangleHeightM * side[2].length)) return false;

  for (std::uint32_t i = 0; i < 3; ++i) {
    const float centimetres = std::min(side[i].length * 100.0F + 0.5F, 65535.0F);
    out.side_cm[i] = static_cast<std::uint16_t>(centimetres);
    out.vertex[i] = static_cast<std::uint8_t>(side[i].opposite);
  }
  out.dot[0] = quantised_dot(b, c);
  out.dot[1] = quantised_dot(a, c);
  out.dot[2] = quantised_dot(a, b);
  out.left_handed = doubled_area < 0.0F ? 1 : 0;
  out.heading = heading_of(ab.x(), ab.y());
  const Eigen::Vector3f center = (a.position + b.position + c.position) / 3.0F;
  out.center_cm[0] = center_step(center.x());
  out.center_cm[1] = center_step(center.y());
  out.sketch[0] = column_sketch(a.occupancy);
  out.sketch[1] = column_sketch(b.occupancy);
  out.sketch[2] = column_sketch(c.occupancy);
  return true;
}

}  // namespace

void build_triangles(std::span<const Keypoint> keypoints, const TriangleConfig& config,
                     FixedVector<Triangle>& out) noexcept {
  out.clear();
  if (keypoints.size() > kMaxKeypoints) keypoints = keypoints.first(kMaxKeypoints);
  Neighbourhood near;
  find_neighbours(keypoints, config, near);
  // Near neighbours of all keypoints before farther ones of any: wherever the list is cut, what
  // remains covers the whole keyframe.
  for (std::uint32_t second = 1; second < kMaxNeighbours; ++second) {
    for (std::uint32_t first = 0; first < second; ++first) {
      for (std::uint32_t i = 0; i < keypoints.size(); ++i) {
        if (second >= near.count[i]) continue;
        const std::uint32_t j = near.list[i][first];
        const std::uint32_t k = near.list[i][second];
        Triangle triangle;
        if (formed_by_earlier(near, i, j, k)) continue;
        if (!make_triangle(keypoints, config, {i, j, k}, triangle)) continue;
        if (!out.push_back(triangle)) return;
      }
    }
  }
}

}  // namespace unimapper::place
