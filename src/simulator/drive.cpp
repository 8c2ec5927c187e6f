#include "drive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unimapper::simulator {

ContinuousOdometry::ContinuousOdometry(std::vector<Frame> truth, std::vector<Frame> odometry,
                                       double interval_s)
    : truth_(std::move(truth)), odometry_(std::move(odometry)), interval_s_(interval_s) {}

Frame ContinuousOdometry::at(double time_s, const Frame& truth) const {
  // In intervals: scan i is at i + 1.
  const double at = time_s / interval_s_;
  constexpr double kRounding = 1e-6;
  const auto after = std::min(
      static_cast<std::size_t>(std::max(0.0, std::ceil(at - kRounding) - 1)), truth_.size() - 1);
  if (after == 0) return orthonormalized(odometry_[0] * truth_[0].inverse() * truth);
  const Frame T_true_before = truth_[after - 1].inverse();
  const Frame T_estimated_before = odometry_[after - 1].inverse();
  const Frame error =
      (T_true_before * truth_[after]).inverse() * (T_estimated_before * odometry_[after]);
  const double share = at - static_cast<double>(after);
  Frame part = rotation_frame(share * rotation_vector(error));
  part.origin = share * error.origin;
  return orthonormalized(odometry_[after - 1] * (T_true_before * truth) * part);
}

}  // namespace unimapper::simulator
