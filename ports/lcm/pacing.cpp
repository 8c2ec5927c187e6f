#include "ports/lcm/pacing.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace unimapper::lcm_port {

namespace {

constexpr std::int64_t kSecondNs = 1000000000;

/// An interval is evaluated after so many pieces, or after a second with at least the fewest.
constexpr std::uint64_t kEnoughPieces = 64;
constexpr std::uint64_t kFewestPieces = 8;
/// While nothing was ever lost, a few that arrived are enough to go on.
constexpr std::uint64_t kFewestToDouble = 4;
/// One that lasted longer tells nothing of the present.
constexpr std::int64_t kLongestIntervalNs = 10 * kSecondNs;

/// Bases answer five times a second: this is a handful of answers lost in a row.
constexpr std::int64_t kShortestSilenceNs = kSecondNs;
constexpr std::int64_t kLongestSilenceNs = 5 * kSecondNs;
/// From when on another base's receipts count.
constexpr std::int64_t kBaseGoneNs = 2 * kSecondNs;

constexpr std::size_t kMostMarks = 64;

/// Longer than the shortest round trip by so much: pieces queue up somewhere.
constexpr std::int64_t kQueueingNs = kSecondNs / 10;
constexpr std::int64_t kLongQueueNs = kSecondNs / 4;

constexpr double kDrain = 0.85;  ///< of the rate that arrives: lets queues run empty
/// Fewer lost pieces in an interval are chance.
constexpr double kFewestLost = 2.5;
constexpr double kTolerance = 0.03;  ///< loss not worth a reaction
/// More is never taken for the link's own.
constexpr double kHighestFloor = 0.5;
/// One fall need not help: what a queue took makes the first loss look small.
constexpr std::uint32_t kFallsToTry = 2;
/// Of a loss that does not depend on the rate so much is left when it has fallen; the interval that
/// the fall began with had more than the mean.
constexpr double kShareThatStays = 0.4;
constexpr double kWellBelow = 0.85;
constexpr std::uint32_t kIntervalsToCompare = 4;

/// After so many intervals the loss that a link is assumed to have at any rate is tested anew: what
/// is lost at twice a link's rate looks the same while nobody sends less.
constexpr std::uint32_t kIntervalsOfFloor = 16;

constexpr double kGrowth = 1.0 / 16.0;
constexpr double kGrowthNearCeiling = 1.0 / 64.0;
/// After so many intervals without harm, the link carries more than it did.
constexpr std::uint32_t kUnharmedToDouble = 24;

constexpr double kBurstSeconds = 0.05;
constexpr double kSmallestBurst = 2600.0;
constexpr double kLargestBurst = 64000.0;

/// Shares of so few pieces scatter: twice the standard deviation of a binomial share.
double scatter(double share, double pieces) {
  return 2.0 * std::sqrt(std::max(0.0, share * (1.0 - share)) / pieces);
}

}  // namespace

Pacing::Pacing(const PacingOptions& options)
    : options_(options), rate_(options.maximum), search_limit_(options.maximum) {
  if (!(options.minimum > 0.0) || !(options.maximum >= options.minimum)) {
    throw std::invalid_argument("a sender's lowest rate lies above 0 and not above the highest");
  }
}

void Pacing::set_maximum(double bytes_per_second) {
  const bool is_unlimited = search_limit_ >= options_.maximum;
  options_.maximum = std::max(options_.minimum, bytes_per_second);
  if (is_unlimited) search_limit_ = options_.maximum;
  rate_ = adapts_ ? std::min(rate_, options_.maximum) : options_.maximum;
}

void Pacing::sent(double bytes) {
  ++sent_pieces_;
  sent_bytes_ += bytes;
}

std::uint32_t Pacing::probe(std::int64_t now_ns) {
  if (marks_.size() >= kMostMarks) marks_.pop_front();
  marks_.push_back({next_number_, now_ns, sent_pieces_, sent_bytes_});
  return next_number_++;
}

bool Pacing::take(const wire::ReceiptMessage& receipt, std::int64_t now_ns) {
  const bool is_other_base = adapts_ && receipt.base != base_;
  if (is_other_base && now_ns - heard_ns_ < kBaseGoneNs) return false;
  if (receipt.number >= next_number_ || receipt.number <= last_answered_) return false;
  while (!marks_.empty() && marks_.front().number < receipt.number) marks_.pop_front();
  const bool is_known = !marks_.empty() && marks_.front().number == receipt.number;
  if (!is_known) return false;
  const Mark mark = marks_.front();
  marks_.pop_front();
  last_answered_ = receipt.number;
  if (!adapts_) change_rate(std::clamp(options_.start, options_.minimum, options_.maximum));
  if (!adapts_ || is_other_base) begin_.reset();
  adapts_ = true;
  base_ = receipt.base;
  heard_ns_ = now_ns;
  timeouts_ = 0;
  window_ = std::max(receipt.window_bytes, wire::kSmallestWindow);
  accounted_bytes_ = std::max(accounted_bytes_, mark.bytes);
  measure_delay(now_ns - mark.time_ns - std::max<std::int64_t>(0, receipt.held_ns));
  measure_interval(mark, receipt.pieces);
  return true;
}

void Pacing::measure_delay(std::int64_t round_trip_ns) {
  round_trip_ns_ = std::max<std::int64_t>(0, round_trip_ns);
  if (shortest_ns_ < 0 || round_trip_ns_ < shortest_ns_) {
    shortest_ns_ = round_trip_ns_;
  } else {
    // Routes change: what was shortest once is forgotten within a minute or so.
    shortest_ns_ += (round_trip_ns_ - shortest_ns_) / 256;
  }
}

void Pacing::measure_interval(const Mark& mark, std::uint64_t arrived) {
  const bool is_of_this_rate = mark.number >= first_of_rate_;
  // A base that started again counts from 0.
  if (!begin_ || arrived < begin_->arrived) {
    begin_.reset();
    if (is_of_this_rate) begin_ = Begin{mark, arrived};
    return;
  }
  const std::uint64_t pieces = mark.pieces - begin_->mark.pieces;
  const std::int64_t took_ns = mark.time_ns - begin_->mark.time_ns;
  const bool is_unharmed = arrived - begin_->arrived >= pieces;
  const bool is_over = pieces >= kEnoughPieces ||
                       (took_ns >= kSecondNs && pieces >= kFewestPieces) ||
                       (doubles_ && is_unharmed && pieces >= kFewestToDouble);
  if (is_over) {
    const auto sent = static_cast<double>(pieces);
    loss_ = std::max(0.0, 1.0 - static_cast<double>(arrived - begin_->arrived) / sent);
    const double bytes = mark.bytes - begin_->mark.bytes;
    const double seconds = static_cast<double>(took_ns) * 1e-9;
    begin_ = Begin{mark, arrived};
    used_rate_ = std::min(rate_, bytes / std::max(seconds, 1e-3));
    decide(loss_, sent, used_rate_ >= 0.5 * rate_);
  } else if (took_ns >= kLongestIntervalNs) {
    begin_ = Begin{mark, arrived};
  }
}

void Pacing::decide(double lost, double pieces, bool rate_was_used) {
  if (floor_ > 0.0 && ++floor_age_ > kIntervalsOfFloor) floor_ = 0.0;
  if (fall_ && fall_->times >= kFallsToTry && lost >= 0.7 * fall_->lost) {
    return accept_loss(lost, fall_->rate);
  }
  if (has_fallen_in_vain(lost, pieces)) return;
  const double excess = lost - floor_;
  const bool is_chance =
      lost * pieces < kFewestLost || excess <= kTolerance + scatter(floor_ + kTolerance, pieces);
  if (!is_chance) return slow_down(excess, lost);
  fall_.reset();
  follow_floor(lost);
  ++unharmed_;
  // Who did not send as much as they might have learns nothing of more.
  if (!rate_was_used) return;
  const std::int64_t queueing_ns = round_trip_ns_ - shortest_ns_;
  if (queueing_ns > kLongQueueNs) return slow_down(0.0, 0.0);
  if (queueing_ns <= kQueueingNs) speed_up();
}

/// The link loses that much at any rate: it was not its bound that was met, and `rate` is right.
void Pacing::accept_loss(double share, double rate) {
  floor_ = std::min(kHighestFloor, std::max(floor_, share));
  floor_age_ = 0;
  fall_.reset();
  peak_.reset();
  search(options_.maximum);
  change_rate(rate);
}

/// Loss near what is worth a reaction is seen in some intervals and not in others: the rate falls
/// further than it grows between. Well below the rate of the first fall a bound of the link would
/// be left behind, so only what is lost there counts.
bool Pacing::has_fallen_in_vain(double lost, double pieces) {
  if (!peak_ || rate_ > std::max(kWellBelow * peak_->rate, options_.minimum)) return false;
  peak_->lost_since += lost * pieces;
  peak_->pieces_since += pieces;
  if (++peak_->intervals < kIntervalsToCompare) return false;
  const Peak peak = *peak_;
  peak_.reset();
  const double share = peak.lost_since / peak.pieces_since;
  if (share <= kTolerance || share < kShareThatStays * peak.lost) return false;
  accept_loss(share, peak.rate);
  return true;
}

/// A link that loses nothing by itself is not taken for one that does: only falls in vain say so.
void Pacing::follow_floor(double lost) {
  if (floor_ <= 0.0) return;
  floor_ = std::min(kHighestFloor, floor_ + (lost - floor_) / (lost < floor_ ? 8.0 : 32.0));
}

void Pacing::slow_down(double excess, double lost) {
  doubles_ = false;
  unharmed_ = 0;
  ceiling_ = rate_;
  if (excess > 0.0) {
    if (!fall_) fall_ = Fall{rate_, lost, 0};
    ++fall_->times;
    if (!peak_) peak_ = Peak{rate_, lost, 0.0, 0.0, 0};
  }
  // Of what was sent: who has little to send would not send less at first.
  change_rate(kDrain * (1.0 - excess / (1.0 - floor_)) * used_rate_);
}

/// Doubles the rate from now on, up to `limit`.
void Pacing::search(double limit) {
  doubles_ = true;
  search_limit_ = limit;
}

void Pacing::speed_up() {
  if (peak_ && rate_ > peak_->rate) peak_.reset();
  if (unharmed_ >= kUnharmedToDouble) search(options_.maximum);
  if (doubles_ && 2.0 * rate_ >= search_limit_ && search_limit_ < options_.maximum) {
    doubles_ = false;
    return change_rate(std::max(rate_, search_limit_));
  }
  const bool is_near = rate_ > 0.9 * ceiling_ && rate_ < 1.15 * ceiling_;
  change_rate(rate_ * (doubles_ ? 2.0 : 1.0 + (is_near ? kGrowthNearCeiling : kGrowth)));
}

/// The next interval begins with the first probe after this.
void Pacing::change_rate(double rate) {
  const double bounded = std::clamp(rate, options_.minimum, options_.maximum);
  if (bounded == rate_) return;
  rate_ = bounded;
  first_of_rate_ = next_number_;
  begin_.reset();
}

void Pacing::advance(std::int64_t now_ns) {
  if (!adapts_) return;
  const std::int64_t silence_ns =
      std::clamp(4 * round_trip_ns_, kShortestSilenceNs, kLongestSilenceNs);
  const bool waits = bytes_on_the_way() > 0.0;
  if (!waits || now_ns - heard_ns_ < silence_ns * (1 + std::int64_t{timeouts_})) return;
  if (timeouts_++ == 0) {
    // Where no bound of the link was met there is none to come near to slowly.
    search(ceiling_ > 0.0 ? kDrain * rate_ : options_.maximum);
    silent_rate_ = std::min(rate_ / 2.0, options_.start);
  }
  accounted_bytes_ = sent_bytes_;
  unharmed_ = 0;
  fall_.reset();
  peak_.reset();
  change_rate(std::max(rate_ / 2.0, silent_rate_));
}

double Pacing::burst_bytes() const {
  return std::clamp(rate_ * kBurstSeconds, kSmallestBurst, kLargestBurst);
}

bool Pacing::has_room(double bytes) const {
  return !window_ || bytes_on_the_way() + bytes <= static_cast<double>(*window_);
}

std::int64_t Pacing::resend_after_ns() const {
  constexpr std::int64_t kTwoAnswersNs = 2 * kSecondNs / 5;
  return std::min(kTwoAnswersNs + 2 * round_trip_ns_, 2 * kLongestSilenceNs);
}

}  // namespace unimapper::lcm_port
