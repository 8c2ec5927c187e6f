// Choice of a worker among lanes of jobs.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

namespace unimapper::nats_port {

/// Keeps a worker among jobs that share keyframes: those of a lane do, and those of lanes beside
/// each other share some.
class LaneChoice {
 public:
  /// `salt`: another one for each worker, so that they begin in different lanes.
  explicit LaneChoice(std::uint32_t salt) : salt_(salt) {}

  /// Lanes in the order in which to look for a job, by the number of jobs that wait in each: that
  /// of the latest job while it has any, then the longest, where nobody may be at work, and of
  /// these those beside the latest one.
  [[nodiscard]] std::vector<std::uint32_t> order(
      const std::map<std::uint32_t, std::uint64_t>& waiting) const {
    using Rank = std::tuple<bool, std::uint64_t, bool, std::uint32_t, std::uint32_t>;
    std::vector<Rank> ranks;
    for (const auto& [lane, jobs] : waiting) {
      const bool is_beside = last_ && (lane == *last_ + 1 || lane + 1 == *last_);
      ranks.emplace_back(lane == last_ && jobs > 0, jobs, is_beside, lane ^ salt_, lane);
    }
    std::sort(ranks.rbegin(), ranks.rend());
    std::vector<std::uint32_t> lanes;
    for (const Rank& rank : ranks) lanes.push_back(std::get<4>(rank));
    return lanes;
  }

  /// The worker took a job of the lane, where it stays as long as there are others.
  void take(std::uint32_t lane) { last_ = lane; }

 private:
  std::uint32_t salt_;
  std::optional<std::uint32_t> last_;
};

}  // namespace unimapper::nats_port
