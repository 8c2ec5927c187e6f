// Validation of the odometry's parameters.
#include "unimapper/odometry/config.hpp"

namespace unimapper {

Error LidarOdometryConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (!error.ok()) return error;
  if (min_range_m >= max_range_m) {
    return {ErrorCode::kInvalidConfig, "min_range_m must be less than max_range_m"};
  }
  return {};
}

}  // namespace unimapper
