#include "ports/datasets/recorded_stamps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "src/core/quantile.hpp"

namespace unimapper::datasets {
namespace {

using Times = std::vector<std::int64_t>;

/// Foreign stamps may be any 64-bit number; differences of these fit.
constexpr std::int64_t kFarthest_ns = INT64_MAX / 4;

/// Without overflow: foreign stamps may step to and fro.
std::int64_t sum_of(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

std::int64_t difference_of(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

/// True of times that differ by less; in doubles, as their difference may not fit.
bool are_near(std::int64_t a, std::int64_t b, std::int64_t apart_ns) {
  return std::abs(static_cast<double>(a) - static_cast<double>(b)) < static_cast<double>(apart_ns);
}

std::int64_t bounded(std::int64_t time_ns) {
  return std::clamp(time_ns, -kFarthest_ns, kFarthest_ns);
}

std::int64_t middle(Times values) { return values.empty() ? 0 : median(std::span(values)); }

std::int64_t middle(const Times& values, std::size_t first, std::size_t end) {
  return middle(Times(values.begin() + static_cast<std::ptrdiff_t>(first),
                      values.begin() + static_cast<std::ptrdiff_t>(end)));
}

/// Median time from a stamp to the next, of those that increase.
std::int64_t period_of(const Times& stamps_ns) {
  Times periods;
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) {
    if (stamps_ns[i] > stamps_ns[i - 1]) periods.push_back(stamps_ns[i] - stamps_ns[i - 1]);
  }
  return middle(std::move(periods));
}

/// Steps of the delay from stamp to recording that last.
class StepSearch {
 public:
  StepSearch(const Times& stamps_ns, const Times& log_ns, std::int64_t period_ns)
      : stamps_ns_(stamps_ns),
        log_ns_(log_ns),
        period_ns_(period_ns),
        least_ns_(std::max<std::int64_t>(2 * period_ns, kLeast_ns)) {
    for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
      delay_ns_.push_back(log_ns[i] - stamps_ns[i]);
    }
  }

  [[nodiscard]] std::vector<ClockStep> find(bool is_forward_known) const {
    std::vector<ClockStep> steps;
    const std::size_t count = delay_ns_.size();
    std::size_t tried = 0;
    for (std::size_t k = kSide; k + kSide <= count; ++k) {
      if (std::abs(delay_ns_[k] - delay_ns_[k - 1]) < least_ns_) continue;
      // Stamps that go on evenly are of one clock: recording was delayed, or its clock was set.
      if (std::abs(stamps_ns_[k] - stamps_ns_[k - 1] - period_ns_) < least_ns_ / 2) continue;
      const std::int64_t before = middle(delay_ns_, k - kSide, k);
      const std::int64_t after = middle(delay_ns_, k, k + kSide);
      const std::int64_t by_ns = before - after;
      if (std::abs(by_ns) < least_ns_ || (by_ns > 0 && !is_forward_known)) continue;
      // A glitch beside the step would begin it too early.
      if (std::abs(delay_ns_[k] - after) > least_ns_ / 2) continue;
      // Stamps that jump all the time are those of no clock.
      if (++tried > kMostTried) return {};
      if (!lasts(k, after)) continue;
      const std::size_t first = steps.empty() ? 0 : steps.back().first;
      steps.push_back({k, refined(first, k, by_ns), log_ns_[k], false});
    }
    return steps;
  }

 private:
  static constexpr std::int64_t kLeast_ns = 150'000'000;
  static constexpr std::size_t kSide = 5;
  static constexpr std::size_t kMostTried = 64;

  /// Times of recording scatter: more of them tell the size better, unless another step is near.
  [[nodiscard]] std::int64_t refined(std::size_t first, std::size_t k, std::int64_t by_ns) const {
    constexpr std::size_t kWide = 50;
    const std::size_t begin = std::max(first, k - std::min(k, kWide));
    const std::size_t end = std::min(k + kWide, delay_ns_.size());
    const std::int64_t wide_ns = middle(delay_ns_, begin, k) - middle(delay_ns_, k, end);
    return are_near(wide_ns, by_ns, least_ns_ / 4) ? wide_ns : by_ns;
  }

  /// Messages that pile up behind a stall come late, but ever less so.
  [[nodiscard]] bool lasts(std::size_t first, std::int64_t delay_ns) const {
    std::size_t near = 0;
    std::size_t i = first;
    for (; i < delay_ns_.size(); ++i) {
      const bool is_near = std::abs(delay_ns_[i] - delay_ns) < least_ns_ / 2;
      near += is_near ? 1 : 0;
      // Another step ends this one's reach.
      if (!is_near && i >= first + kSide && i + kSide <= delay_ns_.size() &&
          std::abs(middle(delay_ns_, i, i + kSide) - middle(delay_ns_, i - kSide, i)) >=
              least_ns_) {
        break;
      }
    }
    return 5 * near >= 4 * (i - first);
  }

  const Times& stamps_ns_;
  const Times& log_ns_;
  std::int64_t period_ns_;
  std::int64_t least_ns_;
  Times delay_ns_;
};

/// Which stamps form the longest sequence that does not decrease.
std::vector<bool> longest_in_order(const Times& stamps_ns) {
  std::vector<std::size_t> last;  // of the best sequence of each length
  std::vector<std::size_t> before(stamps_ns.size(), SIZE_MAX);
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    const auto at =
        std::upper_bound(last.begin(), last.end(), stamps_ns[i],
                         [&](std::int64_t stamp, std::size_t j) { return stamp < stamps_ns[j]; });
    if (at != last.begin()) before[i] = *(at - 1);
    if (at == last.end()) {
      last.push_back(i);
    } else {
      *at = i;
    }
  }
  std::vector<bool> is_in_order(stamps_ns.size(), false);
  for (std::size_t i = last.empty() ? SIZE_MAX : last.back(); i != SIZE_MAX; i = before[i]) {
    is_in_order[i] = true;
  }
  return is_in_order;
}

/// Of stamps out of order those that are wrong; the others were recorded late.
std::vector<bool> find_glitches(const Times& stamps_ns, const Times& log_ns,
                                std::int64_t period_ns) {
  std::vector<bool> is_glitch(stamps_ns.size(), false);
  if (std::is_sorted(stamps_ns.begin(), stamps_ns.end())) return is_glitch;
  const std::vector<bool> is_in_order = longest_in_order(stamps_ns);
  std::set<std::int64_t> right;
  Times delays;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    if (!is_in_order[i]) continue;
    right.insert(stamps_ns[i]);
    delays.push_back(log_ns[i] - stamps_ns[i]);
  }
  const std::int64_t delay_ns = middle(std::move(delays));
  const std::int64_t near_ns = period_ns * 2 / 5;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    if (is_in_order[i]) continue;
    const std::int64_t stamp = stamps_ns[i];
    const auto after = right.lower_bound(stamp);
    const bool fits = (after == right.end() || *after - stamp >= near_ns) &&
                      (after == right.begin() || stamp - *std::prev(after) >= near_ns);
    // Nothing is recorded before it is measured.
    const bool is_early = log_ns[i] - stamp < delay_ns - period_ns;
    if (fits && !is_early) {
      right.insert(stamp);
    } else {
      is_glitch[i] = true;
    }
  }
  return is_glitch;
}

std::string step_text(std::int64_t time_ns) {
  char text[40];
  std::snprintf(text, sizeof text, "%+.3f s", 1e-9 * static_cast<double>(time_ns));
  return text;
}

}  // namespace

std::int64_t RecordedStamps::without_steps(std::size_t i, std::int64_t stamp_ns) const {
  if (steps.empty()) return stamp_ns;
  const auto own_at = [this](std::size_t at) {
    std::int64_t sum = 0;
    for (const ClockStep& step : steps) {
      if (!step.is_of_others && step.first <= at) sum = sum_of(sum, step.by_ns);
    }
    return sum;
  };
  std::int64_t offset = own_at(i);
  std::size_t begin = 0;
  std::size_t longest = 0;
  std::size_t anchor = 0;
  for (std::size_t k = 0; k <= steps.size(); ++k) {
    if (k < steps.size() && steps[k].is_of_others) {
      if (steps[k].first <= i) offset = sum_of(offset, steps[k].by_ns);
      continue;
    }
    const std::size_t end = k < steps.size() ? steps[k].first : is_glitch.size();
    if (end - begin > longest) {
      longest = end - begin;
      anchor = begin;
    }
    begin = end;
  }
  return difference_of(sum_of(stamp_ns, own_at(anchor)), offset);
}

void note_stamps(const RecordedStamps& found, const std::string& what, const std::string& whose,
                 std::vector<Note>& notes) {
  std::string steps;
  for (const ClockStep& step : found.steps) {
    steps += (steps.empty() ? "" : ", ") + step_text(step.by_ns) + " at " + what + " " +
             std::to_string(step.first);
  }
  if (!steps.empty()) {
    notes.push_back({"the clock of " + whose + " steps by " + steps +
                         " (counted from 0) and stays so: stamps are taken as if it did not",
                     true});
  }
  if (found.glitches > 0) {
    notes.push_back({std::to_string(found.glitches) + " " + what +
                         (found.glitches == 1 ? "" : "s") + " of " + whose +
                         " with a stamp that contradicts the order of recording left out, the "
                         "first " +
                         what + " " + std::to_string(found.first_glitch) + " (counted from 0)",
                     true});
  }
}

RecordedStamps check_recorded_stamps(std::span<const std::int64_t> stamps_ns,
                                     std::span<const std::int64_t> log_ns) {
  RecordedStamps found;
  found.is_glitch.assign(stamps_ns.size(), false);
  Times stamps;
  for (const std::int64_t stamp : stamps_ns) stamps.push_back(bounded(stamp));
  const std::int64_t period_ns = std::min(period_of(stamps), kFarthest_ns);
  if (period_ns == 0) return found;
  Times log;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto even = static_cast<std::int64_t>(i) * std::min<std::int64_t>(period_ns, 1LL << 32);
    log.push_back(log_ns.empty() ? even : bounded(log_ns[i]));
  }
  found.steps = StepSearch(stamps, log, period_ns).find(!log_ns.empty());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    stamps[i] = bounded(found.without_steps(i, stamps[i]));
  }
  std::vector<bool> is_glitch = find_glitches(stamps, log, period_ns);
  const auto count = static_cast<std::size_t>(std::count(is_glitch.begin(), is_glitch.end(), true));
  constexpr std::size_t kMostShare = 10;
  if (count == 0 || kMostShare * count >= stamps.size()) return found;
  found.glitches = count;
  found.first_glitch = static_cast<std::size_t>(
      std::find(is_glitch.begin(), is_glitch.end(), true) - is_glitch.begin());
  found.is_glitch = std::move(is_glitch);
  return found;
}

void find_common_steps(RecordedStamps& a, RecordedStamps& b) {
  constexpr std::int64_t kApart_ns = 1'000'000'000;
  constexpr std::int64_t kDiffer_ns = 100'000'000;
  for (ClockStep& of_a : a.steps) {
    for (ClockStep& of_b : b.steps) {
      if (!are_near(of_a.log_ns, of_b.log_ns, kApart_ns) ||
          !are_near(of_a.by_ns, of_b.by_ns, kDiffer_ns)) {
        continue;
      }
      of_a.is_of_others = of_b.is_of_others = true;
      of_b.by_ns = of_a.by_ns;
    }
  }
}

}  // namespace unimapper::datasets
