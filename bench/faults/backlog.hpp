// Backlog of a sender: how long catching up takes after a fault.
#pragma once

#include <cstdint>
#include <optional>

namespace unimapper::bench {

/// Watches how many keyframes were published but not acknowledged.
class Backlog {
 public:
  /// What is on its way in any case.
  static constexpr std::uint64_t kCaughtUp = 2;

  /// At any time, seconds of one clock.
  void add(double now_s, std::uint64_t published, std::uint64_t acknowledged) {
    const std::uint64_t waiting = published - acknowledged;
    if (waiting >= largest_) {
      largest_ = waiting;
      largest_at_s_ = now_s;
      caught_up_s_.reset();
    }
    if (waiting <= kCaughtUp && !caught_up_s_) caught_up_s_ = now_s - largest_at_s_;
  }

  /// Most keyframes that waited at once.
  [[nodiscard]] std::uint64_t largest() const { return largest_; }
  /// Seconds from the last time that most waited until at most `kCaughtUp` did; nothing if more
  /// did to the end.
  [[nodiscard]] std::optional<double> caught_up_s() const { return caught_up_s_; }

 private:
  std::uint64_t largest_ = 0;
  double largest_at_s_ = 0.0;
  std::optional<double> caught_up_s_;
};

}  // namespace unimapper::bench
