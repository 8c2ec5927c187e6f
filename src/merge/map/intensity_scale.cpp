#include "intensity_scale.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
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

  // What brings each session to the scale of the first of its group, by way of the earlier session
  // with which it shares most.
  std::vector<double> scale(sessions.size(), 0.0);
  std::vector<std::size_t> group(sessions.size());
  std::vector<double> least(sessions.size(), 0.0);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    group[s] = s;
    std::size_t most = kLeastVoxels;
    for (const auto& [pair, ratios] : pairs) {
      if (pair.second != s || ratios.total() < most) continue;
      most = ratios.total();
      scale[s] = scale[pair.first] + ratios.scale();
      group[s] = group[pair.first];
    }
    least[group[s]] = std::min(least[group[s]], scale[s]);
  }
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    factors[s] = static_cast<float>(std::exp2(scale[s] - least[group[s]]));
  }
  return factors;
}

}  // namespace unimapper::merge
