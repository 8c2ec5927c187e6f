// C interface of the odometry.
#include "unimapper/odometry/odometry.hpp"

#include <cstring>
#include <limits>
#include <new>

#include "ports/c/convert.hpp"
#include "ports/c/handle.hpp"
#include "ports/c/unimapper_odometry.h"

using namespace unimapper;
using namespace unimapper::c;

/// What the handle points to; the odometry proper follows it in the same block.
struct alignas(UM_ALIGNMENT) um_odometry {
  std::uint64_t magic;
  LidarOdometry* core;
  double up[3];
  double up_sigma_rad;
};

namespace {

// "odometry" as a number.
constexpr std::uint64_t kOdometryMagic = 0x6f646f6d65747279ULL;

bool is_odometry(const um_odometry* odometry) noexcept {
  return odometry != nullptr && is_aligned(odometry) && odometry->magic == kOdometryMagic;
}

LidarOdometryConfig from_c(const um_odometry_config& config) noexcept {
  LidarOdometryConfig core;
  core.max_range_m = config.max_range_m;
  core.min_range_m = config.min_range_m;
  core.voxel_m = config.voxel_m;
  core.max_voxels = config.max_voxels;
  core.max_points = config.max_points;
  return core;
}

void write(const OdometryResult& from, um_odometry_result& to) noexcept {
  to.state = static_cast<std::int32_t>(from.state);
  to.T_odometry_sensor = to_c(from.T_odometry_sensor);
  for (int i = 0; i < 3; ++i) {
    to.velocity_m_s[i] = from.velocity_m_s[i];
    to.angular_velocity_rad_s[i] = from.angular_velocity_rad_s[i];
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      to.covariance[6 * row + column] = from.covariance(row, column);
      // An axis is a column there and a row here.
      to.weak_axes[row][column] = from.weak.axes(column, row);
    }
  }
  to.weak_axis_count = from.weak.count;
  to.reserved = 0;
  to.reason = from.reason;
}

}  // namespace

extern "C" {

um_status um_odometry_config_init(um_odometry_config* config) {
  if (config == nullptr) return UM_NULL_ARGUMENT;
  const LidarOdometryConfig core;
  *config = {};
  config->max_voxels = core.max_voxels;
  config->max_points = core.max_points;
  config->min_range_m = core.min_range_m;
  config->max_range_m = core.max_range_m;
  config->voxel_m = core.voxel_m;
  return UM_OK;
}

std::size_t um_odometry_required_bytes(const um_odometry_config* config) {
  if (config == nullptr) return 0;
  const std::size_t core = LidarOdometry::required_bytes(from_c(*config));
  return core == 0 ? 0 : sizeof(um_odometry) + core;
}

um_status um_odometry_init(const um_odometry_config* config, void* memory, std::size_t bytes,
                           um_odometry** odometry, const char** message) {
  const auto say = [message](um_status status, const char* text) {
    if (message != nullptr) *message = text;
    return status;
  };
  const auto fail = [&say](um_status status) { return say(status, um_status_text(status)); };
  if (odometry == nullptr) return fail(UM_NULL_ARGUMENT);
  *odometry = nullptr;
  if (config == nullptr || memory == nullptr) return fail(UM_NULL_ARGUMENT);
  if (!is_aligned(memory)) return fail(UM_MEMORY_MISALIGNED);
  const LidarOdometryConfig core = from_c(*config);
  if (const Error error = core.validate(); !error.ok()) return say(to_c(error.code), error.message);
  if (bytes < um_odometry_required_bytes(config)) {
    return say(UM_MEMORY_TOO_SMALL,
               "the memory is smaller than um_odometry_required_bytes(config)");
  }
  auto* const made = new (memory) um_odometry{};
  const auto created = LidarOdometry::create(
      core, {static_cast<std::byte*>(memory) + sizeof(um_odometry), bytes - sizeof(um_odometry)});
  if (!created.ok()) return say(to_c(created.error().code), created.error().message);
  made->core = created.value();
  made->up[2] = 1.0;
  made->up_sigma_rad = std::numeric_limits<double>::infinity();
  made->magic = kOdometryMagic;
  *odometry = made;
  return say(UM_OK, "");
}

um_status um_odometry_add_angular_velocity(um_odometry* odometry, std::int64_t stamp_ns,
                                           const double rad_s[3]) {
  if (!is_odometry(odometry)) return UM_INVALID_HANDLE;
  if (rad_s == nullptr) return UM_NULL_ARGUMENT;
  const Eigen::Vector3d angular_velocity(rad_s[0], rad_s[1], rad_s[2]);
  return to_c(odometry->core->add_angular_velocity(stamp_ns, angular_velocity).code);
}

um_status um_odometry_add_acceleration(um_odometry* odometry, std::int64_t stamp_ns,
                                       const double m_s2[3]) {
  if (!is_odometry(odometry)) return UM_INVALID_HANDLE;
  if (m_s2 == nullptr) return UM_NULL_ARGUMENT;
  const Eigen::Vector3d acceleration(m_s2[0], m_s2[1], m_s2[2]);
  return to_c(odometry->core->add_acceleration(stamp_ns, acceleration).code);
}

um_status um_odometry_up(const um_odometry* odometry, double up[3], double* sigma_rad) {
  if (!is_odometry(odometry)) return UM_INVALID_HANDLE;
  if (up == nullptr || sigma_rad == nullptr) return UM_NULL_ARGUMENT;
  for (int i = 0; i < 3; ++i) up[i] = odometry->up[i];
  *sigma_rad = odometry->up_sigma_rad;
  return UM_OK;
}

um_status um_odometry_add_scan(um_odometry* odometry, const um_points* points, const float* time_s,
                               std::int64_t stamp_ns, um_odometry_result* result) {
  if (!is_odometry(odometry)) return UM_INVALID_HANDLE;
  if (points == nullptr || result == nullptr) return UM_NULL_ARGUMENT;
  if (!is_possible(*points)) return UM_INVALID_POINTS;
  const std::size_t times = time_s == nullptr ? 0 : points->count;
  const OdometryResult core = odometry->core->add_scan(stamp_ns, to_view(*points), {time_s, times});
  write(core, *result);
  for (int i = 0; i < 3; ++i) odometry->up[i] = core.up[i];
  odometry->up_sigma_rad = core.up_sigma_rad;
  return to_c(core.error.code);
}

um_status um_odometry_slip(const um_odometry_result* result, double covariance[9]) {
  if (result == nullptr || covariance == nullptr) return UM_NULL_ARGUMENT;
  if (result->weak_axis_count > 6) return UM_INVALID_INDEX;
  OdometryResult core;
  core.state = static_cast<OdometryState>(result->state);
  core.T_odometry_sensor = from_c(result->T_odometry_sensor);
  core.weak.count = result->weak_axis_count;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      core.covariance(row, column) = result->covariance[6 * row + column];
      core.weak.axes(column, row) = result->weak_axes[row][column];
    }
  }
  Eigen::Map<Eigen::Matrix3d> slip(covariance);
  slip = slip_of(core);
  return UM_OK;
}

}  // extern "C"
