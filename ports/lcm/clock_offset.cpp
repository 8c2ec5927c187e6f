#include "ports/lcm/clock_offset.hpp"

#include <algorithm>

namespace unimapper::lcm_port {

namespace {

constexpr std::int64_t kNsPerDriftNs = 10000;  // 100 ppm

/// Reading two clocks one after the other, and what a base's software adds to an arrival.
constexpr std::int64_t kReadingNs = 50000;

/// A clock that is slewed moves less than this between two looks; a step moves more.
constexpr std::int64_t kRobotStepNs = 10000000;

/// Times from the network are anything.
constexpr std::int64_t kLatestNs = std::int64_t{1} << 62U;

std::int64_t distance(std::int64_t a, std::int64_t b) { return a > b ? a - b : b - a; }

}  // namespace

std::int64_t ClockOffsetFilter::bound_at(const Sample& sample, std::int64_t now_ns) {
  return sample.bound_ns + distance(now_ns, sample.at_ns) / kNsPerDriftNs;
}

bool ClockOffsetFilter::agree(const Sample& a, const Sample& b) {
  return distance(a.difference_ns, b.difference_ns) <= bound_at(a, b.at_ns) + b.bound_ns;
}

const ClockOffsetFilter::Sample* ClockOffsetFilter::best(std::int64_t now_ns) const {
  const auto end = samples_.begin() + static_cast<std::ptrdiff_t>(used_);
  const auto sample = std::min_element(
      samples_.begin(), end,
      [&](const Sample& a, const Sample& b) { return bound_at(a, now_ns) < bound_at(b, now_ns); });
  return sample == end ? nullptr : &*sample;
}

void ClockOffsetFilter::add(std::int64_t sent_ns, std::int64_t base_time_ns,
                            std::int64_t round_trip_ns) {
  if (base_time_ns < 0 || base_time_ns > kLatestNs || round_trip_ns < 0) return;
  const std::int64_t half = round_trip_ns / 2;
  const Sample sample{sent_ns + half, base_time_ns - (sent_ns + half), half + kReadingNs};
  const Sample* const estimate = best(sample.at_ns);
  if (estimate != nullptr && !agree(*estimate, sample)) {
    const bool is_step = suspect_ && agree(*suspect_, sample);
    const Sample first = suspect_.value_or(sample);
    suspect_ = sample;
    if (!is_step) return;
    ++steps_;
    samples_[0] = first;
    used_ = 1;
    next_ = 1;
  }
  suspect_.reset();
  samples_[next_] = sample;
  next_ = (next_ + 1) % kSamples;
  used_ = std::min(used_ + 1, kSamples);
}

std::optional<wire::ClockOffset> ClockOffsetFilter::offset(const RobotTime& now) {
  const std::int64_t epoch = now.unix_ns - now.steady_ns;
  if (robot_epoch_ns_ && distance(*robot_epoch_ns_, epoch) > kRobotStepNs) ++steps_;
  robot_epoch_ns_ = epoch;
  const Sample* const sample = best(now.steady_ns);
  if (sample == nullptr) return std::nullopt;
  return wire::ClockOffset{sample->difference_ns - epoch, bound_at(*sample, now.steady_ns), steps_};
}

}  // namespace unimapper::lcm_port
