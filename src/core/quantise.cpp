#include "quantise.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>

#include "voxel_key.hpp"

namespace unimapper {
namespace {

constexpr double kMaxCode = 32767.0;

/// Rounds to a grid of `steps_per_metre`; nothing if an axis leaves [lowest, highest].
std::optional<Eigen::Vector3i> to_steps(const Eigen::Vector3f& position, double steps_per_metre,
                                        std::int32_t lowest, std::int32_t highest) noexcept {
  Eigen::Vector3i steps;
  for (int axis = 0; axis < 3; ++axis) {
    const double raised = static_cast<double>(position[axis]) * steps_per_metre + 0.5;
    // Written so that NaN fails it too.
    if (!(raised >= lowest && raised < highest + 1.0)) return std::nullopt;
    steps[axis] = floor_to<std::int32_t>(raised);
  }
  return steps;
}

std::int16_t round_to_code(double value) noexcept {
  return static_cast<std::int16_t>(floor_to<std::int32_t>(value * kMaxCode + 0.5));
}

double sign_of(double value) noexcept { return value < 0.0 ? -1.0 : 1.0; }

/// On the rim of the square (c, v) and (c, -v) are the same vector; the positive one is used.
OctahedralNormal canonical(OctahedralNormal code) noexcept {
  constexpr std::int16_t kRim = 32767;
  const bool on_u_rim = std::abs(code.u) == kRim;
  const bool on_v_rim = std::abs(code.v) == kRim;
  if (on_u_rim) code.v = static_cast<std::int16_t>(std::abs(code.v));
  if (on_v_rim) code.u = static_cast<std::int16_t>(std::abs(code.u));
  return code;
}

}  // namespace

std::optional<Eigen::Vector3i> to_millimetres(const Eigen::Vector3f& position) noexcept {
  return to_steps(position, 1e3, -kMillimetreLimit, kMillimetreLimit);
}

Eigen::Vector3f from_millimetres(const Eigen::Vector3i& millimetres) noexcept {
  return (millimetres.cast<double>() * 1e-3).cast<float>();
}

std::optional<Eigen::Vector3i> to_centimetres(const Eigen::Vector3f& position) noexcept {
  return to_steps(position, 1e2, std::numeric_limits<std::int16_t>::min(),
                  std::numeric_limits<std::int16_t>::max());
}

Eigen::Vector3f from_centimetres(const Eigen::Vector3i& centimetres) noexcept {
  return (centimetres.cast<double>() * 1e-2).cast<float>();
}

std::optional<OctahedralNormal> octahedral(const Eigen::Vector3f& normal) noexcept {
  const Eigen::Vector3d n = normal.cast<double>();
  const double sum = n.cwiseAbs().sum();
  if (!std::isfinite(sum) || sum <= 0.0) return std::nullopt;
  double u = n.x() / sum;
  double v = n.y() / sum;
  if (n.z() < 0.0) {
    const double folded_u = (1.0 - std::abs(v)) * sign_of(u);
    v = (1.0 - std::abs(u)) * sign_of(v);
    u = folded_u;
  }
  return canonical({round_to_code(u), round_to_code(v)});
}

Eigen::Vector3f unit_vector(OctahedralNormal code) noexcept {
  const double u = code.u / kMaxCode;
  const double v = code.v / kMaxCode;
  // In integers, so that the equator is exactly the equator.
  const int height =
      32767 - std::abs(static_cast<int>(code.u)) - std::abs(static_cast<int>(code.v));
  Eigen::Vector3d n(u, v, height / kMaxCode);
  if (height < 0) {
    n.x() = (1.0 - std::abs(v)) * sign_of(u);
    n.y() = (1.0 - std::abs(u)) * sign_of(v);
  }
  // Not Eigen's normalized(): its vectorised sum of squares may round differently per machine.
  const double length = std::sqrt(n.x() * n.x() + n.y() * n.y() + n.z() * n.z());
  return (n / length).cast<float>();
}

bool is_canonical(OctahedralNormal code) noexcept {
  return code.u >= -32767 && code.v >= -32767 && canonical(code) == code;
}

}  // namespace unimapper
