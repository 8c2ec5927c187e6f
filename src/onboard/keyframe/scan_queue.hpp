// Queue of scans that wait while a keyframe is being closed
#pragma once

#include <cstddef>
#include <cstdint>

#include "keyframe.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/core/point_view.hpp"

namespace unimapper::onboard {

/// Copies of scans in the order of their arrival, with what is to happen before and after them.
class ScanQueue {
 public:
  struct Scan {
    PointView points;  ///< the first `max_points` of the scan
    ScanOrigin origin;
    bool restarted;  ///< the odometry was, before this scan
    bool closes;     ///< the keyframe closes after this scan
  };

  void allocate(Arena& arena, std::uint32_t scans, std::uint32_t max_points,
                bool with_intensities) noexcept {
    capacity_ = scans;
    max_points_ = max_points;
    scans_ = arena.allocate<Scan>(scans);
    xyz_ = arena.allocate<float>(std::size_t{3} * max_points * scans);
    if (!with_intensities) return;
    intensities_ = arena.allocate<std::uint8_t>(std::size_t{max_points} * scans);
  }

  [[nodiscard]] bool is_empty() const noexcept { return size_ == 0; }
  [[nodiscard]] bool is_full() const noexcept { return size_ == capacity_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

  /// Copies a scan; there must be room. O(points).
  void push(const PointView& points, const ScanOrigin& origin, bool restarted) noexcept;
  /// The oldest and the newest one; there must be one.
  [[nodiscard]] const Scan& front() const noexcept { return scans_[first_]; }
  [[nodiscard]] Scan& back() noexcept { return scans_[(first_ + size_ - 1) % capacity_]; }
  /// The `i`-th, from the oldest.
  [[nodiscard]] const Scan& operator[](std::uint32_t i) const noexcept {
    return scans_[(first_ + i) % capacity_];
  }
  void pop() noexcept {
    first_ = (first_ + 1) % capacity_;
    --size_;
  }

 private:
  std::uint32_t capacity_ = 0;
  std::uint32_t max_points_ = 0;
  std::uint32_t first_ = 0;
  std::uint32_t size_ = 0;
  Scan* scans_ = nullptr;
  float* xyz_ = nullptr;                 ///< `max_points_` for each
  std::uint8_t* intensities_ = nullptr;  ///< `max_points_` for each, or null
};

}  // namespace unimapper::onboard
