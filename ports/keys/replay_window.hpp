// Window of datagram numbers that have arrived.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>

namespace unimapper::keys {

/// Tells numbers that are new from those that came before. A number that lies more than `kWidth`
/// below the highest counts as old: datagrams may overtake one another, but not by so much.
class ReplayWindow {
 public:
  static constexpr std::uint64_t kWidth = 4096;

  /// True for a number that was not here; it is from now on. O(1), O(kWidth) after a jump.
  bool insert(std::uint64_t number) {
    if (!any_) {
      any_ = true;
      highest_ = number;
    } else if (number > highest_) {
      const std::uint64_t step = number - highest_;
      seen_ = step < kWidth ? seen_ << static_cast<std::size_t>(step) : Bits();
      highest_ = number;
    }
    const std::uint64_t below = highest_ - number;
    if (below >= kWidth || seen_[static_cast<std::size_t>(below)]) return false;
    seen_.set(static_cast<std::size_t>(below));
    return true;
  }

 private:
  using Bits = std::bitset<kWidth>;
  bool any_ = false;
  std::uint64_t highest_ = 0;
  Bits seen_;  ///< bit i: `highest_` - i
};

}  // namespace unimapper::keys
