// Seeded faults of one direction of a link: the fate of each datagram.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace unimapper::bench {

/// What a direction does to datagrams. Shares are per datagram, from 0 to 1.
struct LinkFaults {
  double drop = 0.0;           ///< share that is lost
  double fragment_drop = 0.0;  ///< share of 1,480-byte Ethernet fragments that is lost
  double duplicate = 0.0;      ///< share that arrives twice, the second up to 20 ms later
  double reorder = 0.0;        ///< share that is held for `hold_ms`
  double flip = 0.0;           ///< share of which one bit is flipped
  double delay_ms = 0.0;       ///< of every datagram
  double hold_ms = 30.0;       ///< of those that are reordered
  double down_from_s = 0.0;    ///< when the direction goes down, after the relay's first datagram
  double down_for_s = 0.0;     ///< for how long
  double rate = 0.0;           ///< bytes per second that pass; 0: any
  double queue = 16000.0;      ///< bytes that wait for it; what does not fit is lost
};

/// Reads "drop=0.05,delay=10,down=4+1": the names drop, fragments, duplicate, reorder, flip
/// (shares), delay, hold (ms), down (seconds FROM+FOR), rate (bytes per second) and queue (bytes).
/// Throws std::invalid_argument for anything else.
LinkFaults parse_faults(std::string_view text);

/// Ethernet fragments of a UDP datagram with so many bytes of content.
[[nodiscard]] std::size_t fragments_of(std::size_t bytes);

/// What happens to one datagram.
struct Fate {
  bool down = false;                      ///< lost since the direction was down
  std::size_t copies = 1;                 ///< 0: lost
  std::array<double, 2> delay_ms{};       ///< of each copy
  bool reordered = false;                 ///< the first copy is held
  std::optional<std::uint64_t> flip_bit;  ///< to be taken modulo the datagram's bits
};

/// Decides the fates of a direction's datagrams. The same seed and number of the datagram give the
/// same decision, whatever the datagrams before it were; but for the bottleneck, where time counts.
class FaultyDirection {
 public:
  FaultyDirection(const LinkFaults& faults, std::uint64_t seed) : faults_(faults), seed_(seed) {}

  /// Of the next datagram; `since_start_s` after the relay's first one.
  Fate next(std::size_t bytes, double since_start_s);

 private:
  LinkFaults faults_;
  std::uint64_t seed_;
  /// False if the queue has no room; else `delay_ms` grows by the time until the datagram is
  /// through.
  bool pass_bottleneck(std::size_t bytes, double since_start_s, double& delay_ms);

  std::uint64_t number_ = 0;
  double free_at_s_ = 0.0;  ///< when the bottleneck has sent all that waits
};

}  // namespace unimapper::bench
