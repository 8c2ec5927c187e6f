#include "motion_pair.hpp"

#include <cmath>

namespace unimapper::onboard {

void PoseHistory::add(const Pose& pose, std::int64_t stamp_ns) noexcept {
  entries_[next_] = {pose, stamp_ns};
  next_ = (next_ + 1) % kKept;
  size_ = size_ < kKept ? size_ + 1 : kKept;
}

const PoseHistory::Entry* PoseHistory::before(std::uint32_t scans) const noexcept {
  return scans < size_ ? &entries_[(next_ + kKept - 1 - scans) % kKept] : nullptr;
}

void MotionPair::Window::set(std::uint32_t k, const Pose& relative,
                             std::int64_t pose_stamp_ns) noexcept {
  std::array<float, 12>& to = poses[k];
  for (int i = 0; i < 9; ++i) {
    to[static_cast<std::size_t>(i)] = static_cast<float>(relative.rotation(i / 3, i % 3));
  }
  for (int i = 0; i < 3; ++i) {
    to[static_cast<std::size_t>(9 + i)] = static_cast<float>(relative.translation[i]);
  }
  after_s[k] = static_cast<float>(1e-9 * static_cast<double>(pose_stamp_ns - stamp_ns));
  known |= 1U << k;
}

Pose MotionPair::Window::at(std::uint32_t k) const noexcept {
  const std::array<float, 12>& from = poses[k];
  Pose pose;
  for (int i = 0; i < 9; ++i) {
    pose.rotation(i / 3, i % 3) = static_cast<double>(from[static_cast<std::size_t>(i)]);
  }
  for (int i = 0; i < 3; ++i) {
    pose.translation[i] = static_cast<double>(from[static_cast<std::size_t>(9 + i)]);
  }
  return pose;
}

bool MotionPair::Window::at(double delay_s, double interval_s, Pose& pose) const noexcept {
  std::uint32_t nearest = 1;
  double least_s = 1e9;
  for (std::uint32_t k = 1; k + 1 < kPoses; ++k) {
    const double ahead_s = std::fabs(delay_s - static_cast<double>(after_s[k]));
    if (ahead_s >= least_s) continue;
    least_s = ahead_s;
    nearest = k;
  }
  if (least_s > interval_s) return false;
  const double span_s = static_cast<double>(after_s[nearest + 1] - after_s[nearest - 1]);
  if (!(span_s > 0.0) || span_s > 3.0 * interval_s) return false;
  pose = moved_on(at(nearest - 1), at(nearest), at(nearest + 1), span_s,
                  delay_s - static_cast<double>(after_s[nearest]));
  return true;
}

void MotionPair::begin(std::uint32_t scan, const PoseHistory& history) noexcept {
  const PoseHistory::Entry& now = *history.before(0);
  if (scan == 0) base_ = now.pose;
  Window& window = windows_[scan];
  window.stamp_ns = now.stamp_ns;
  window.known = 0;
  for (std::uint32_t k = 0; k <= kAbout; ++k) {
    const PoseHistory::Entry* const entry = history.before(kAbout - k);
    if (entry != nullptr) window.set(k, base_.inverse() * entry->pose, entry->stamp_ns);
  }
}

void MotionPair::add(std::uint32_t scan, std::uint32_t scans, const Pose& pose,
                     std::int64_t stamp_ns) noexcept {
  if (scans > kAbout) return;
  windows_[scan].set(kAbout + scans, base_.inverse() * pose, stamp_ns);
}

bool MotionPair::close() noexcept {
  for (std::uint32_t scan = 0; scan < 2; ++scan) {
    const Window& window = windows_[scan];
    if (window.known != (1U << kPoses) - 1U) return false;
    const Twist difference =
        fourth_difference({window.at(kAbout - 2), window.at(kAbout - 1), window.at(kAbout),
                           window.at(kAbout + 1), window.at(kAbout + 2)});
    for (int c = 0; c < 6; ++c) {
      differences[scan][static_cast<std::size_t>(c)] = static_cast<float>(difference[c]);
    }
  }
  return true;
}

double MotionPair::interval_s() const noexcept {
  const Window& window = windows_[0];
  return static_cast<double>(window.after_s[kPoses - 1] - window.after_s[0]) /
         static_cast<double>(kPoses - 1);
}

Pose MotionPair::without(KnownMistake mistake) const noexcept {
  const Pose second = base_ * given();
  return correct(mistake, base_).inverse() * correct(mistake, second);
}

bool MotionPair::given(double delay_s, Pose& motion) const noexcept {
  Pose first;
  Pose second;
  const double interval = interval_s();
  if (!windows_[0].at(delay_s, interval, first)) return false;
  if (!windows_[1].at(delay_s, interval, second)) return false;
  motion = first.inverse() * second;
  return true;
}

}  // namespace unimapper::onboard
