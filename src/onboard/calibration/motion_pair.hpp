// A pair of scans: the motion that was registered, and the given poses about both
#pragma once

#include <array>
#include <cstdint>

#include "src/core/hand_eye.hpp"
#include "src/core/known_mistake.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {

/// The last given poses.
class PoseHistory {
 public:
  static constexpr std::uint32_t kKept = 4;
  struct Entry {
    Pose pose;
    std::int64_t stamp_ns = 0;
  };
  void forget() noexcept { size_ = 0; }
  void add(const Pose& pose, std::int64_t stamp_ns) noexcept;
  /// So many scans before the last one; null where there was none.
  [[nodiscard]] const Entry* before(std::uint32_t scans) const noexcept;

 private:
  std::array<Entry, kKept> entries_;
  std::uint32_t size_ = 0;
  std::uint32_t next_ = 0;
};

/// Given poses from three scans before to three behind each scan of a pair, in single precision
/// relative to that of the first scan.
class MotionPair {
 public:
  static constexpr std::uint32_t kAbout = PoseHistory::kKept - 1;  ///< scans on either side
  static constexpr std::uint32_t kPoses = 2 * kAbout + 1;

  Pose registered;  ///< T_first_second of the LiDAR
  /// Fourth differences of the given poses about both scans.
  std::array<std::array<float, 6>, 2> differences{};

  /// The last pose of the history is that of the first, or second, scan.
  void begin(std::uint32_t scan, const PoseHistory& history) noexcept;
  /// A pose `scans` behind that of the scan; false if that is too many.
  void add(std::uint32_t scan, std::uint32_t scans, const Pose& pose,
           std::int64_t stamp_ns) noexcept;
  /// All poses are there: measures differences. False if some are missing.
  bool close() noexcept;

  [[nodiscard]] std::int64_t stamp_ns(std::uint32_t scan) const noexcept {
    return windows_[scan].stamp_ns;
  }
  [[nodiscard]] double seconds() const noexcept {
    return 1e-9 * static_cast<double>(stamp_ns(1) - stamp_ns(0));
  }
  [[nodiscard]] double interval_s() const noexcept;
  /// The given motion, as it was given.
  [[nodiscard]] Pose given() const noexcept { return windows_[1].at(kAbout); }
  /// From the first scan to a pose.
  [[nodiscard]] Pose moved_to(const Pose& pose) const noexcept { return base_.inverse() * pose; }
  /// The given motion with a mistake undone.
  [[nodiscard]] Pose without(KnownMistake mistake) const noexcept;
  /// The given motion at both stamps plus a delay; false where no poses are known.
  [[nodiscard]] bool given(double delay_s, Pose& motion) const noexcept;

 private:
  struct Window {
    std::int64_t stamp_ns = 0;
    std::uint32_t known = 0;                          ///< a bit for each pose
    std::array<std::array<float, 12>, kPoses> poses;  ///< rotation by rows, translation
    std::array<float, kPoses> after_s;                ///< the scan's stamp

    void set(std::uint32_t k, const Pose& relative, std::int64_t pose_stamp_ns) noexcept;
    [[nodiscard]] Pose at(std::uint32_t k) const noexcept;
    [[nodiscard]] bool at(double delay_s, double interval_s, Pose& pose) const noexcept;
  };

  Pose base_;  ///< given pose of the first scan
  std::array<Window, 2> windows_;
};

}  // namespace unimapper::onboard
