#include "unimapper/odometry/odometry.hpp"

#include <cstddef>
#include <cstdint>
#include <new>

#include "tracker.hpp"

namespace unimapper {

struct LidarOdometry::State : odometry::Tracker {
  explicit State(const LidarOdometryConfig& c) noexcept : Tracker(c) {}

  LidarOdometry odometry;
};

std::size_t LidarOdometry::required_bytes(const LidarOdometryConfig& config) noexcept {
  if (!config.validate().ok()) return 0;
  Arena arena = Arena::measuring();
  arena.allocate<std::byte>(sizeof(State));
  State state(config);
  state.allocate(arena);
  return arena.used();
}

Expected<LidarOdometry*> LidarOdometry::create(const LidarOdometryConfig& config,
                                               std::span<std::byte> memory) noexcept {
  const Error invalid = config.validate();
  if (!invalid.ok()) return invalid;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
    return Error{ErrorCode::kMemoryMisaligned, "the memory must start on a 64-byte boundary"};
  }
  if (memory.size() < required_bytes(config)) {
    return Error{ErrorCode::kMemoryTooSmall,
                 "the memory is smaller than LidarOdometry::required_bytes(config)"};
  }
  Arena arena(memory.data(), memory.size());
  State* const state = new (arena.allocate<std::byte>(sizeof(State))) State(config);
  state->allocate(arena);
  state->odometry.state_ = state;
  return &state->odometry;
}

Error LidarOdometry::add_angular_velocity(std::int64_t stamp_ns,
                                          const Eigen::Vector3d& rad_s) noexcept {
  const Error error = state_->gyroscope.add(stamp_ns, rad_s);
  OdometryStatistics& statistics = state_->statistics;
  ++(error.ok() ? statistics.angular_velocities : statistics.angular_velocities_refused);
  return error;
}

Error LidarOdometry::add_acceleration(std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) noexcept {
  const Error error = state_->accelerometer.add(stamp_ns, m_s2);
  OdometryStatistics& statistics = state_->statistics;
  ++(error.ok() ? statistics.accelerations : statistics.accelerations_refused);
  return error;
}

OdometryResult LidarOdometry::add_scan(std::int64_t stamp_ns, const PointView& points,
                                       std::span<const float> time_s) noexcept {
  return state_->levelled(state_->add_scan(stamp_ns, points, time_s));
}

const OdometryStatistics& LidarOdometry::statistics() const noexcept {
  const odometry::Accelerometer& accelerometer = state_->accelerometer;
  state_->statistics.updates_of_up = accelerometer.updates();
  state_->statistics.updates_in_g = accelerometer.updates_in_g();
  state_->statistics.updates_implausible = accelerometer.implausible();
  return state_->statistics;
}

const LidarOdometryConfig& LidarOdometry::config() const noexcept { return state_->config; }

}  // namespace unimapper
