#include "ports/datasets/bag/bag_fixes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <utility>

namespace unimapper::datasets::bag {
namespace {

// Of a receiver without corrections, whose messages do not say.
constexpr double kUnknownSigmaXy_m = 5.0;
constexpr double kUnknownSigmaZ_m = 10.0;

bool is_place(const FixMessage& fix) {
  // Where there was no fix many drivers write zeros.
  const bool is_origin = fix.latitude_deg == 0.0 && fix.longitude_deg == 0.0;
  return std::abs(fix.latitude_deg) <= 90.0 && std::abs(fix.longitude_deg) <= 180.0 &&
         std::abs(fix.height_m) <= 1e4 && !is_origin;
}

/// Standard deviations of east and north, the larger one, and of up; none: not known.
std::optional<std::array<double, 2>> sigmas(const FixMessage& fix) {
  const double horizontal = std::max(fix.variances[0], fix.variances[1]);
  const double vertical = fix.variances[2];
  const auto is_variance = [](double value) { return value > 0.0 && value <= 1e8; };
  if (!fix.has_variances || !is_variance(horizontal) || !is_variance(vertical)) {
    return std::nullopt;
  }
  // No receiver knows better.
  constexpr double kLeast_m = 0.005;
  return std::array{std::max(kLeast_m, std::sqrt(horizontal)),
                    std::max(kLeast_m, std::sqrt(vertical))};
}

/// What one topic gives.
struct UsableFixes {
  std::vector<Fix> fixes;
  std::set<std::string> frames;  ///< of the antenna
  double information = 0.0;      ///< sum of the inverse variances
  std::size_t without_fix = 0;
  std::size_t no_place = 0;
  std::size_t without_stamp = 0;
  std::size_t without_sigma = 0;
  std::size_t without_lever = 0;

  [[nodiscard]] std::string text() const {
    std::string text = std::to_string(fixes.size()) + " taken";
    const std::pair<std::size_t, const char*> others[] = {
        {without_fix, " without a fix"},
        {no_place, " of no place"},
        {without_stamp, " without a stamp"},
        {without_sigma, " taken with 5 m, 10 m in height, for no deviation is given"}};
    for (const auto& [count, what] : others) {
      if (count > 0) text += ", " + std::to_string(count) + what;
    }
    return text;
  }
};

UsableFixes usable(const FixTopic& topic, const TransformTree& transforms,
                   const std::string& lidar_frame) {
  UsableFixes found;
  for (const FixMessage& message : topic.recorded) {
    std::size_t* const fault = message.status < 0             ? &found.without_fix
                               : !is_place(message)           ? &found.no_place
                               : message.header.stamp_ns == 0 ? &found.without_stamp
                                                              : nullptr;
    if (fault != nullptr) {
      ++*fault;
      continue;
    }
    const auto known = sigmas(message);
    found.without_sigma += known ? 0 : 1;
    const auto [xy, z] = known.value_or(std::array{kUnknownSigmaXy_m, kUnknownSigmaZ_m});
    Fix& fix = found.fixes.emplace_back(Fix{message.header.stamp_ns,
                                            message.latitude_deg,
                                            message.longitude_deg,
                                            message.height_m,
                                            xy,
                                            z,
                                            {}});
    found.information += 1.0 / (xy * xy);
    found.frames.insert(message.header.frame);
    if (transforms.is_rigid(lidar_frame, message.header.frame)) {
      const auto T_lidar_antenna =
          transforms.lookup(lidar_frame, message.header.frame, message.header.stamp_ns);
      if (T_lidar_antenna) fix.lever = T_lidar_antenna->translation;
    }
    found.without_lever += fix.lever ? 0 : 1;
  }
  return found;
}

}  // namespace

std::vector<Fix> choose_fixes(const std::map<std::size_t, FixTopic>& topics,
                              const TransformTree& transforms, const std::string& lidar_frame,
                              std::vector<Note>& notes) {
  UsableFixes best;
  const FixTopic* chosen = nullptr;
  for (const auto& [number, topic] : topics) {
    UsableFixes found = usable(topic, transforms, lidar_frame);
    if (chosen != nullptr && found.information <= best.information) continue;
    best = std::move(found);
    chosen = &topic;
  }
  if (chosen == nullptr) return {};
  std::string text = "known positions: " + chosen->description + ": " + best.text();
  if (topics.size() > 1) {
    text +=
        "; left out are " + std::to_string(topics.size() - 1) + " other topics, which tell less";
  }
  notes.push_back({text, best.fixes.empty()});
  if (best.without_lever > 0) {
    notes.push_back({"no transform tells where the antenna '" + *best.frames.begin() +
                         "' is on the LiDAR '" + lidar_frame +
                         "': " + std::to_string(best.without_lever) +
                         " known positions are taken for those of the LiDAR itself",
                     true});
  }
  return std::move(best.fixes);
}

}  // namespace unimapper::datasets::bag
