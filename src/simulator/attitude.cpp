#include "attitude.hpp"

#include "random.hpp"

namespace unimapper::simulator {

Frame mount_frame(const Mount& mount) {
  return rotation_frame({0.0, mount.pitch_deg * kDegree, 0.0}) *
         rotation_frame({mount.roll_deg * kDegree, 0.0, 0.0});
}

SwayingBody::SwayingBody(const Sway& sway, std::uint64_t key) : sway_(sway) {
  Random random(key);
  roll_phase_ = random.uniform(0.0, 2.0 * kPi);
  pitch_phase_ = random.uniform(0.0, 2.0 * kPi);
}

Frame SwayingBody::at(double time_s) const {
  if (sway_.amplitude_deg == 0.0) return {};
  const double amplitude = sway_.amplitude_deg * kDegree;
  const double turn = 2.0 * kPi * sway_.frequency_hz * time_s;
  return rotation_frame({0.0, amplitude * std::sin(turn + pitch_phase_), 0.0}) *
         rotation_frame({amplitude * std::sin(turn + roll_phase_), 0.0, 0.0});
}

void add_attitude_noise(const AttitudeNoise& noise, double interval_s, const Frame& T_body_points,
                        std::uint64_t key, std::vector<Frame>& poses) {
  if (noise.sigma_deg == 0.0) return;
  const double sigma = noise.sigma_deg * kDegree;
  // A first-order Gauss-Markov process per axis.
  const double keep = noise.correlated_s > 0.0 ? std::exp(-interval_s / noise.correlated_s) : 0.0;
  const double fresh = std::sqrt(1.0 - keep * keep);
  Random random(key);
  Vec3 error{sigma * random.gauss(), sigma * random.gauss(), 0.0};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    error.x = keep * error.x + fresh * sigma * random.gauss();
    error.y = keep * error.y + fresh * sigma * random.gauss();
    const Frame turn = T_body_points.inverse() * rotation_frame(error) * T_body_points;
    poses[i] = orthonormalized(poses[i] * turn);
  }
}

}  // namespace unimapper::simulator
