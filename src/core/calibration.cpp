#include "src/core/calibration.hpp"

#include <cmath>
#include <limits>

namespace unimapper {

bool Estimate::is_surely_beyond(double least, double surely) const noexcept {
  return std::fabs(value) > least && std::fabs(value) > surely * sigma;
}

bool Calibration::shows_rotation() const noexcept {
  constexpr double kShown_deg = 0.5;
  return motions > 0 && pitch_deg.sigma < kShown_deg && yaw_deg.sigma < kShown_deg;
}

bool Calibration::shows_lever_arm() const noexcept {
  constexpr double kShown_m = 0.3;
  return motions > 0 && x_m.sigma < kShown_m && y_m.sigma < kShown_m;
}

bool Calibration::shows_delay() const noexcept {
  constexpr double kShown_s = 0.03;
  return motions > 0 && delay_s.sigma < kShown_s;
}

bool Calibration::is_surely_right() const noexcept {
  constexpr double kQuiet_deg = 0.3;
  // What half of the motions do not show may be shown by one of the others. Roll and height are
  // shown by none where a robot drives on a level.
  const auto is_right = [](const Estimate& e, double said, double shown) noexcept {
    const double size = std::fabs(e.value);
    return size + 3.0 * e.sigma < said || (size < 1.5 * e.sigma && e.sigma < shown);
  };
  constexpr double kAny = std::numeric_limits<double>::infinity();
  return motions > 0 && attitude_noise_deg < kQuiet_deg &&
         is_right(roll_deg, kSaidRoll_deg, kAny) && is_right(pitch_deg, kSaid_deg, kSaid_deg) &&
         is_right(yaw_deg, kSaid_deg, kSaid_deg) && is_right(x_m, kSaid_m, kSaid_m) &&
         is_right(y_m, kSaid_m, kSaid_m) && is_right(z_m, kSaid_m, kAny) &&
         is_right(delay_s, least_delay_s(), least_delay_s());
}

Pose Calibration::sure_mount() const noexcept {
  if (motions == 0) return {};
  const auto sure = [](const Estimate& e, double least) noexcept {
    return e.is_surely_beyond(least) ? e.value : 0.0;
  };
  const double up_m = z_m.is_surely_beyond(kSaid_m, kMoreSurely) ? z_m.value : 0.0;
  HandEye::Parameters p = HandEye::Parameters::Zero();
  p.head<3>() << sure(roll_deg, kSaidRoll_deg), sure(pitch_deg, kSaid_deg),
      sure(yaw_deg, kSaid_deg);
  p.head<3>() /= kDegreesPerRadian;
  p.segment<3>(3) << sure(x_m, kSaid_m), sure(y_m, kSaid_m), up_m;
  return HandEye::mount_of(p);
}

double Calibration::least_delay_s() const noexcept {
  constexpr double kBeyondHalf_s = 0.015;
  return 0.5 * interval_s + kBeyondHalf_s;
}

double Calibration::sure_delay_s() const noexcept {
  const bool is_sure = delay_s.is_surely_beyond(least_delay_s(), kMoreSurely);
  return motions > 0 && is_sure ? delay_s.value : 0.0;
}

Calibration calibration_of(const HandEye::Solution& solution, double interval_s) noexcept {
  Calibration result;
  result.misfit = static_cast<double>(solution.motions) * solution.misfit;
  // Where no mount and no delay makes the motions agree, poses and scans differ otherwise.
  if (solution.motions < kFewestMotions || !solution.agrees()) return result;
  // What registration is off by itself, however many motions there are.
  constexpr double kBias_deg = 0.1;
  constexpr double kBias_m = 0.05;
  constexpr double kBias_s = 0.005;
  constexpr double kBias = 0.005;
  const auto estimate = [&](int k, double unit, double bias) noexcept {
    const double sigma = solution.sigmas[k] * unit;
    return Estimate{solution.parameters[k] * unit, std::sqrt(sigma * sigma + bias * bias)};
  };
  result.motions = solution.motions;
  result.interval_s = interval_s;
  result.roll_deg = estimate(0, kDegreesPerRadian, kBias_deg);
  result.pitch_deg = estimate(1, kDegreesPerRadian, kBias_deg);
  result.yaw_deg = estimate(2, kDegreesPerRadian, kBias_deg);
  result.x_m = estimate(3, 1.0, kBias_m);
  result.y_m = estimate(4, 1.0, kBias_m);
  result.z_m = estimate(5, 1.0, kBias_m);
  result.delay_s = estimate(6, 1.0, kBias_s);
  result.scale = estimate(7, 1.0, kBias);
  result.attitude_noise_deg = attitude_noise_deg(solution.noise);
  return result;
}

double attitude_noise_deg(const Twist& noise) noexcept {
  return noise.head<2>().maxCoeff() * kDegreesPerRadian;
}

}  // namespace unimapper
