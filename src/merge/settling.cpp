#include "settling.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "voxel_table.hpp"

namespace unimapper::merge {
namespace {

constexpr std::int32_t kMeanReach = 2;    ///< places around a cell whose evidence counts, too
constexpr std::int32_t kPatchPlaces = 5;  ///< ground is judged by patches of a metre

std::int32_t floor_divide(std::int32_t a, std::int32_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// Evidence by place: several cells may share one.
class Settling {
 public:
  Settling(const JudgedCells& cells, const RefinementConfig& config)
      : cells_(cells), config_(config), place_of_(cells.size()) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      place_of_[i] = table_.find_or_insert(cells.place[i]);
      if (place_of_[i] == places_.size()) places_.emplace_back();
      Place& place = places_[place_of_[i]];
      place.sum += std::clamp(cells.log_odds[i], -config.confirmed_static_log_odds,
                              config.confirmed_static_log_odds);
      place.cells += 1.0F;
    }
  }

  std::vector<std::uint8_t> run() {
    average();
    reject_ground_seen_through();
    connect();
    return decide();
  }

 private:
  struct Place {
    float sum = 0.0F;    ///< of the clipped evidence
    float cells = 0.0F;  ///< that share the place
    float mean = 0.0F;   ///< of the evidence here and around
    bool ground = false;
    bool connects = false;
    std::uint32_t parent = 0;   ///< component, as a forest
    std::uint32_t size = 0;     ///< cells of the component, at its root,
    std::uint32_t dynamic = 0;  ///< and those with evidence for "dynamic"
  };

  [[nodiscard]] std::uint32_t neighbour(std::uint32_t place, std::int32_t x, std::int32_t y,
                                        std::int32_t z) const {
    const VoxelIndex at = unpack(table_.key(place));
    return table_.find(pack({at.x + x, at.y + y, at.z + z}));
  }

  /// Places in the order of their keys are rows along x; the rows around a place move on with it,
  /// so that nothing is searched for.
  void average() {
    std::vector<std::uint32_t> order(places_.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return table_.key(a) < table_.key(b); });
    std::vector<float> sum(places_.size(), 0.0F);
    std::vector<float> cells(places_.size(), 0.0F);
    constexpr auto kOrigin = static_cast<std::int64_t>(pack({0, 0, 0}));
    for (std::int32_t z = -kMeanReach; z <= kMeanReach; ++z) {
      for (std::int32_t y = -kMeanReach; y <= kMeanReach; ++y) {
        const std::int64_t row = static_cast<std::int64_t>(pack({0, y, z})) - kOrigin;
        std::size_t first = 0;
        for (const std::uint32_t p : order) {
          const VoxelKey middle = table_.key(p) + static_cast<VoxelKey>(row);
          while (first < order.size() && table_.key(order[first]) < middle - kMeanReach) ++first;
          for (std::size_t i = first; i < order.size(); ++i) {
            if (table_.key(order[i]) > middle + kMeanReach) break;
            sum[p] += places_[order[i]].sum;
            cells[p] += places_[order[i]].cells;
          }
        }
      }
    }
    for (std::uint32_t p = 0; p < places_.size(); ++p) places_[p].mean = sum[p] / cells[p];
  }

  /// The roof or the bumper of a car that drove past may have looked like ground. Single cells of
  /// real ground are seen through, too, where rays graze it; whole patches are not.
  void reject_ground_seen_through() {
    VoxelTable patches;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> seen;  // all cells, and those seen through
    std::vector<std::uint32_t> patch_of(cells_.size(), VoxelTable::kNone);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_.ground[i] == 0) continue;
      const VoxelIndex at = unpack(cells_.place[i]);
      patch_of[i] = patches.find_or_insert(
          pack({floor_divide(at.x, kPatchPlaces), floor_divide(at.y, kPatchPlaces),
                floor_divide(at.z, kPatchPlaces)}));
      if (patch_of[i] == seen.size()) seen.emplace_back(0, 0);
      ++seen[patch_of[i]].first;
      if (places_[place_of_[i]].mean > config_.ground_log_odds) ++seen[patch_of[i]].second;
    }
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (patch_of[i] == VoxelTable::kNone) continue;
      const auto [all, through] = seen[patch_of[i]];
      const float share = static_cast<float>(through) / static_cast<float>(all);
      if (share < config_.ground_share) places_[place_of_[i]].ground = true;
    }
  }

  std::uint32_t root(std::uint32_t p) {
    while (places_[p].parent != p) p = places_[p].parent = places_[places_[p].parent].parent;
    return p;
  }

  void connect() {
    for (std::uint32_t p = 0; p < places_.size(); ++p) places_[p].parent = p;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      Place& place = places_[place_of_[i]];
      if (!place.ground && cells_.low[i] == 0) place.connects = true;
    }
    for (std::uint32_t p = 0; p < places_.size(); ++p) {
      if (!places_[p].connects) continue;
      // Half of the neighbours meet every pair once.
      for (std::int32_t n = 0; n < 13; ++n) join(p, n);
    }
    for (std::uint32_t p = 0; p < places_.size(); ++p) {
      if (places_[p].connects || places_[p].ground) continue;
      // A low cell follows what it touches, what lies above it first.
      for (std::int32_t n = 26; n >= 0 && places_[p].parent == p; --n) join(p, n);
    }
  }

  void join(std::uint32_t place, std::int32_t n) {
    const std::uint32_t other = neighbour(place, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if (other == VoxelTable::kNone || !places_[other].connects) return;
    const std::uint32_t a = root(place);
    const std::uint32_t b = root(other);
    if (!places_[place].connects) {
      places_[a].parent = b;
    } else {
      places_[std::max(a, b)].parent = std::min(a, b);
    }
  }

  std::vector<std::uint8_t> decide() {
    for (const std::uint32_t p : place_of_) {
      if (places_[p].ground) continue;
      Place& component = places_[root(p)];
      ++component.size;
      component.dynamic += places_[p].mean > 0.0F ? 1 : 0;
    }
    std::vector<std::uint8_t> dynamic(cells_.size(), 0);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const Place& place = places_[place_of_[i]];
      if (place.ground) continue;
      const Place& component = places_[root(place_of_[i])];
      const float share =
          static_cast<float>(component.dynamic) / static_cast<float>(component.size);
      bool is_dynamic = place.mean > 0.0F;
      if (share >= config_.component_dynamic_share) {
        is_dynamic = is_dynamic || cells_.log_odds[i] > -config_.confirmed_static_log_odds;
      } else if (share < config_.component_static_share) {
        is_dynamic = false;
      }
      dynamic[i] = is_dynamic ? 1 : 0;
    }
    return dynamic;
  }

  const JudgedCells& cells_;
  const RefinementConfig& config_;
  VoxelTable table_;
  std::vector<Place> places_;
  std::vector<std::uint32_t> place_of_;  ///< by cell
};

}  // namespace

std::vector<std::uint8_t> settle(const JudgedCells& cells, const RefinementConfig& config) {
  return Settling(cells, config).run();
}

}  // namespace unimapper::merge
