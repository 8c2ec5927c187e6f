// Control of a sender's rate by what arrives, and of what is on the way by the base's window.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

/// Bounds of the rate, bytes per second.
struct PacingOptions {
  double minimum = 4000.0;  ///< never slower; a link of 32 kbit/s
  double maximum = 20e6;    ///< never faster; also the rate until a base sends receipts
  double start = 250e3;     ///< with which the search for the rate begins
};

/// Finds the rate that the link carries. Probes cut what is sent into intervals; of each, receipts
/// tell the share that was lost and the round trip. The rate doubles until something is lost or
/// queues up; from then on it grows by 1/16 an interval, more slowly near where it was too high
/// last, and falls to 0.85 of what arrived where more is lost than the link loses at any rate.
/// That share is known from falls that did not help. Until a base sends receipts the
/// rate is the maximum. No clock of its own: times are the caller's, in ns of any steady clock;
/// equal events give equal rates. Every call is O(1) but for at most 64 probes under way.
class Pacing {
 public:
  /// Throws std::invalid_argument unless 0 < minimum and minimum <= maximum.
  explicit Pacing(const PacingOptions& options);

  /// From now on the rate is at most this, bytes per second, but not below the minimum.
  void set_maximum(double bytes_per_second);
  /// A piece of so many bytes was sent.
  void sent(double bytes);
  /// The number of the probe to be sent now.
  std::uint32_t probe(std::int64_t now_ns);
  /// Takes an answer to one of the probes. Others, those of a second base while the first one
  /// answers, and those overtaken by later ones say nothing. True if it was used: `round_trip_ns`
  /// is that of the receipt.
  bool take(const wire::ReceiptMessage& receipt, std::int64_t now_ns);
  /// To be told the time now and then: what nothing was heard of for too long counts as lost, and
  /// the rate halves, but not below half of what it was nor below that of the start, whichever is
  /// less.
  void advance(std::int64_t now_ns);

  /// Bytes per second.
  [[nodiscard]] double rate() const { return rate_; }
  /// Bytes that may go at once: what the rate carries in 50 ms, at least 2,600.
  [[nodiscard]] double burst_bytes() const;
  /// Whether the window has room for a piece. Always true until a base has announced one.
  [[nodiscard]] bool has_room(double bytes) const;
  /// Bytes sent of which no receipt has said anything yet.
  [[nodiscard]] double bytes_on_the_way() const { return sent_bytes_ - accounted_bytes_; }
  /// What the base announced; nothing until one has.
  [[nodiscard]] std::optional<std::uint64_t> window_bytes() const { return window_; }
  /// Of the latest receipt, without the base's part; 0 before.
  [[nodiscard]] std::int64_t round_trip_ns() const { return round_trip_ns_; }
  /// Share of the pieces lost in the last interval, 0 to 1.
  [[nodiscard]] double loss() const { return loss_; }
  /// Whether a base sends receipts; without, the rate is the maximum.
  [[nodiscard]] bool adapts() const { return adapts_; }
  /// A base sent receipts, and now does no more.
  [[nodiscard]] bool is_silent() const { return timeouts_ > 0; }
  /// After so long, what was sent and did not arrive is lost, and not late.
  [[nodiscard]] std::int64_t resend_after_ns() const;

 private:
  /// What had been sent when a probe was.
  struct Mark {
    std::uint32_t number = 0;
    std::int64_t time_ns = 0;
    std::uint64_t pieces = 0;
    double bytes = 0.0;
  };
  /// Begin of an interval: a probe and what had arrived before it.
  struct Begin {
    Mark mark;
    std::uint64_t arrived = 0;
  };

  void measure_delay(std::int64_t round_trip_ns);
  void measure_interval(const Mark& mark, std::uint64_t arrived);
  void decide(double lost, double pieces, bool rate_was_used);
  void follow_floor(double lost);
  void slow_down(double excess, double lost);
  bool has_fallen_in_vain(double lost, double pieces);
  void accept_loss(double share, double rate);
  void speed_up();
  void search(double limit);
  void change_rate(double rate);

  PacingOptions options_;
  double rate_;
  bool adapts_ = false;          ///< a base sends receipts
  bool doubles_ = true;          ///< no bound of the link has been met
  double search_limit_;          ///< up to which it doubles
  double ceiling_ = 0.0;         ///< rate that was too high last
  std::uint32_t unharmed_ = 0;   ///< intervals without excess loss since
  double floor_ = 0.0;           ///< share that is lost at any rate
  std::uint32_t floor_age_ = 0;  ///< intervals since that was found

  /// Falls in a row: what was before the first, until it is known whether they helped.
  struct Fall {
    double rate = 0.0;
    double lost = 0.0;
    std::uint32_t times = 0;
  };
  std::optional<Fall> fall_;
  /// Before the rate began to fall, and what was lost since well below it.
  struct Peak {
    double rate = 0.0;
    double lost = 0.0;        ///< share, in the interval that it fell after
    double lost_since = 0.0;  ///< pieces
    double pieces_since = 0.0;
    std::uint32_t intervals = 0;
  };
  std::optional<Peak> peak_;

  std::uint64_t base_ = 0;
  std::optional<std::uint64_t> window_;
  std::uint64_t sent_pieces_ = 0;
  double sent_bytes_ = 0.0;
  double accounted_bytes_ = 0.0;  ///< sent bytes that receipts tell of, or that count as lost
  std::uint32_t next_number_ = 1;
  std::uint32_t first_of_rate_ = 1;  ///< the first probe since the rate changed
  std::uint32_t last_answered_ = 0;
  std::deque<Mark> marks_;  ///< probes without an answer
  std::optional<Begin> begin_;
  std::int64_t heard_ns_ = 0;
  std::uint32_t timeouts_ = 0;  ///< since a receipt was heard
  double silent_rate_ = 0.0;    ///< lowest rate until a receipt is heard
  std::int64_t round_trip_ns_ = 0;
  std::int64_t shortest_ns_ = -1;  ///< round trip with empty queues
  double loss_ = 0.0;
  double used_rate_ = 0.0;  ///< of the rate, in the last interval
};

}  // namespace unimapper::lcm_port
