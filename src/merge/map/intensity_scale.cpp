#include "intensity_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {
namespace {

/// Binary logarithms of ratios of two sessions, up to 256, in sixteenths.
class Ratios {
 public:
  void add(float ratio) {
    const int sixteenths = static_cast<int>(std::lround(16.0F * std::log2(ratio)));
    ++counts_[static_cast<std::size_t>(std::clamp(sixteenths, -kMost, kMost) + kMost)];
    ++total_;
  }
  [[nodiscard]] std::size_t total() const { return total_; }
  /// Logarithm of the median; ratios up to two are of one scale: ranges and angles differ.
  [[nodiscard]] double scale() const {
    std::size_t bin = 0;
    for (std::size_t below = counts_[0]; 2 * below < total_; below += counts_[bin]) ++bin;
    const double median = (static_cast<double>(bin) - kMost) / 16.0;
    return std::abs(median) >= 1.0 ? median : 0.0;
  }

 private:
  static constexpr int kMost = 8 * 16;
  std::array<std::size_t, std::size_t{2} * kMost + 1> counts_{};
  std::size_t total_ = 0;
};

/// What lies at the end of the scale tells nothing about it.
constexpr float kSaturated = 250.0F;

using Pairs = std::map<std::pair<std::size_t, std::size_t>, Ratios>;

/// Compares every session with the first one that knows an intensity of the voxel.
void compare_tile(const std::vector<const SessionVoxels*>& sessions, const MapTile& tile,
                  Pairs& pairs) {
  VoxelTable table;
  std::vector<std::pair<std::size_t, float>> first;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (sessions[s] == nullptr || !sessions[s]->has_intensity()) continue;
    sessions[s]->visit(tile, [&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
      if (voxel.intensity.count() == 0) return;
      const float mean = voxel.intensity.mean();
      if (mean > kSaturated) return;
      const std::uint32_t number = table.find_or_insert(key);
      if (number == first.size()) {
        first.emplace_back(s, mean);
      } else {
        pairs[{first[number].first, s}].add(first[number].second / mean);
      }
    });
  }
}

}  // namespace

std::vector<float> intensity_factors(const std::vector<const SessionVoxels*>& sessions) {
  constexpr std::size_t kLeastVoxels = 200;
  std::set<MapTile> tiles;
  std::size_t with = 0;
  for (const SessionVoxels* session : sessions) {
    if (session == nullptr || !session->has_intensity()) continue;
    ++with;
    for (const auto& [tile, size] : session->sizes()) tiles.insert(tile);
  }
  std::vector<float> factors(sessions.size(), 1.0F);
  if (with < 2) return factors;
  Pairs pairs;
  for (const MapTile& tile : tiles) compare_tile(sessions, tile, pairs);

  // What brings each session to the scale of its group: by way of those with which it shares most.
  std::vector<std::pair<std::size_t, std::pair<std::size_t, std::size_t>>> by_total;
  for (const auto& [pair, ratios] : pairs) {
    if (ratios.total() >= kLeastVoxels) by_total.emplace_back(ratios.total(), pair);
  }
  std::sort(by_total.rbegin(), by_total.rend());
  std::vector<double> scale(sessions.size(), 0.0);
  std::vector<std::size_t> group(sessions.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (const auto& [total, pair] : by_total) {
    const auto [one, other] = pair;
    const std::size_t joined = group[other];
    if (joined == group[one]) continue;
    const double shift = scale[one] + pairs.at(pair).scale() - scale[other];
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      if (group[s] != joined) continue;
      scale[s] += shift;
      group[s] = group[one];
    }
  }
  std::vector<double> least(sessions.size(), std::numeric_limits<double>::max());
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    least[group[s]] = std::min(least[group[s]], scale[s]);
  }
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    factors[s] = static_cast<float>(std::exp2(scale[s] - least[group[s]]));
  }
  return factors;
}

}  // namespace unimapper::merge
