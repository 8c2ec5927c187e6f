#include "cell_classification.hpp"

#include <algorithm>
#include <bit>

#include "src/free_space/component_outline.hpp"
#include "src/free_space/components.hpp"
#include "src/free_space/evidence_sum.hpp"
#include "src/free_space/ground_patch.hpp"
#include "src/free_space/relabelling.hpp"
#include "src/merge/heap_memory.hpp"
#include "src/merge/voxel_table.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "voxel_blocks.hpp"

namespace unimapper::merge {
namespace {

constexpr std::int32_t kPatchVoxels = 5;  ///< ground is rejected by patches of a metre
/// Of a patch: the evidence of a single cell is already a mean over its surroundings.
constexpr std::uint32_t kFewestGroundCells = 1;
constexpr float kGroundLogOdds = 1.0F;  ///< ground counts as seen through above it; measured

/// A component is dynamic if the evidence around at least this share of its cells says so;
/// measured.
constexpr float kComponentDynamicShare = 0.4F;

/// Of a moved part, measured: least number of connected cells seen through that are dynamic within
/// a static component, their least mean log-odds, and most other keyframes of the window that
/// occupied its voxels, mean over its cells.
constexpr std::uint32_t kMovedPartCells = 30;
constexpr float kMovedPartLogOdds = 0.3F;
constexpr float kMovedPartOccupied = 0.5F;

/// Voxels that touch, by row.
class VoxelComponents {
 public:
  /// Of the rows for which `connects(row)` holds; those for which only `follows(row)` does are
  /// attached to a component that they touch. O(voxels).
  template <typename Connects, typename Follows>
  VoxelComponents(const VoxelBlocks& blocks, const Connects& connects, const Follows& follows)
      : blocks_(blocks.blocks()), labelled_(blocks_.size(), {0, 0}) {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      std::uint32_t row = blocks_[b].first;
      for (std::uint64_t left = blocks_[b].occupied; left != 0; left &= left - 1, ++row) {
        if (connects(row)) {
          labelled_[b].connecting |= lowest_bit(left);
        } else if (follows(row)) {
          labelled_[b].low |= lowest_bit(left);
        }
      }
    }
    components_.allocate(memory_, blocks_.size(),
                         blocks_.size() * ComponentLabels::kMaxPartsPerBlock);
    components_.label(
        static_cast<std::uint32_t>(blocks_.size()), [&](std::uint32_t b) { return labelled_[b]; },
        [&](std::uint32_t b, const BlockOffset& to) { return blocks.neighbour(b, to); });
  }

  /// Components are numbered, with gaps, below this.
  [[nodiscard]] std::size_t size() const { return components_.size(); }

  /// Calls `use(component, row)` for every voxel of a component.
  template <typename Use>
  void visit(const Use& use) const {
    visit_parts([&](std::uint32_t component, const Block& block, std::uint64_t some) {
      for (std::uint64_t left = some; left != 0; left &= left - 1) {
        use(component, row_of(block, static_cast<std::uint32_t>(std::countr_zero(left))));
      }
    });
  }

  /// The boxes around the connecting voxels of every component, from the first block on.
  [[nodiscard]] std::vector<CellBox> boxes() const {
    std::vector<CellBox> boxes(size());
    visit_parts([&](std::uint32_t component, const Block& block, std::uint64_t some) {
      const VoxelIndex& first = blocks_.front().index;
      const std::uint64_t high = some & labelled_[number(block)].connecting;
      if (high == 0) return;
      boxes[component].include(
          {block.index.x - first.x, block.index.y - first.y, block.index.z - first.z}, high);
    });
    return boxes;
  }

 private:
  /// Calls `use(component, block, voxels)`, some voxels of one block at a time.
  template <typename Use>
  void visit_parts(const Use& use) const {
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
      components_.visit(b, [&](std::uint32_t component, std::uint64_t some) {
        use(component, blocks_[b], some);
      });
    }
  }
  [[nodiscard]] std::size_t number(const Block& block) const {
    return static_cast<std::size_t>(&block - blocks_.data());
  }

  const std::vector<Block>& blocks_;
  std::vector<LabelledCells> labelled_;
  HeapMemory memory_;
  ComponentLabels components_;
};

/// Evidence by voxel: several cells may share one.
class CellClassifier {
 public:
  CellClassifier(const CellEvidence& cells, float cell_size_m)
      : cells_(cells),
        cell_size_m_(cell_size_m),
        confirmed_static_(in_thousandths(EvidenceDefaults::kConfirmedStaticLogOdds)),
        blocks_(cells.voxel),
        voxels_(blocks_.rows()),
        row_of_(cells.size()) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      row_of_[i] = blocks_.row_of_voxel(i);
      Voxel& voxel = voxels_[row_of_[i]];
      voxel.evidence.add(clamped(cells.log_odds[i]), cells.occupied[i]);
    }
  }

  std::vector<std::uint8_t> run() {
    average(nullptr);
    reject_ground_seen_through();
    const std::vector<std::uint64_t> known_ground = ground();
    average(&known_ground);
    classify_components();
    find_moved_parts();
    return labels();
  }

 private:
  struct Voxel {
    EvidenceSum evidence;  ///< of its cells
    float mean = 0.0F;     ///< of the evidence here and around, thousandths
    bool ground = false;
    bool connects = false;
    bool has_component = false;
    ComponentClass component = ComponentClass::kMixed;
    bool moved = false;  ///< belongs to a part of a static component that moved
    bool keeps = false;  ///< belongs to a component that is dynamic only where the robot said so
  };
  struct Tally {
    EvidenceSum evidence;
    std::uint32_t dynamic = 0;  ///< cells with evidence for "dynamic" around them
  };

  [[nodiscard]] std::int32_t clamped(std::int32_t log_odds) const {
    return std::clamp(log_odds, -confirmed_static_, confirmed_static_);
  }

  /// Ground says nothing about what stands or walks on it: once it is known, it is left out of the
  /// mean of all other voxels. Its own mean has all of them and stays as it was.
  void average(const std::vector<std::uint64_t>* ground) {
    std::vector<SurroundingSum> value;
    value.reserve(voxels_.size());
    for (const Voxel& voxel : voxels_) {
      value.push_back({voxel.evidence.log_odds, voxel.evidence.cells});
    }
    SurroundingSums sums(blocks_, value, ground);
    for (std::uint32_t b = 0; b < blocks_.blocks().size(); ++b) {
      if (ground != nullptr && !sums.leaves_out_near(b)) continue;
      sums.visit(b, [&](std::uint32_t row, const SurroundingSum& sum) {
        voxels_[row].mean = static_cast<float>(sum.log_odds) / static_cast<float>(sum.cells);
      });
    }
  }

  /// The voxels of ground, by block.
  [[nodiscard]] std::vector<std::uint64_t> ground() const {
    std::vector<std::uint64_t> ground;
    ground.reserve(blocks_.blocks().size());
    for (const Block& block : blocks_.blocks()) {
      std::uint64_t cells = 0;
      visit_rows(block, block.occupied, [&](std::uint64_t cell, std::uint32_t row) {
        if (voxels_[row].ground) cells |= cell;
      });
      ground.push_back(cells);
    }
    return ground;
  }

  void reject_ground_seen_through() {
    const auto least = static_cast<float>(in_thousandths(kGroundLogOdds));
    VoxelTable table;
    std::vector<GroundPatch> patches;
    std::vector<std::uint32_t> patch_of(cells_.size(), VoxelTable::kNone);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_.ground[i] == 0) continue;
      const VoxelIndex at = unpack(cells_.voxel[i]);
      patch_of[i] = table.find_or_insert(
          pack({floor_divide(at.x, kPatchVoxels), floor_divide(at.y, kPatchVoxels),
                floor_divide(at.z, kPatchVoxels)}));
      if (patch_of[i] == patches.size()) patches.emplace_back();
      patches[patch_of[i]].add(voxels_[row_of_[i]].mean > least);
    }
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (patch_of[i] == VoxelTable::kNone) continue;
      if (!patches[patch_of[i]].is_transparent(EvidenceDefaults::kSeenThroughShare,
                                               kFewestGroundCells)) {
        voxels_[row_of_[i]].ground = true;
      }
    }
  }

  void classify_components() {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      Voxel& voxel = voxels_[row_of_[i]];
      if (!voxel.ground && cells_.low[i] == 0) voxel.connects = true;
    }
    const VoxelComponents components(
        blocks_, [&](std::uint32_t row) { return voxels_[row].connects; },
        [&](std::uint32_t row) { return !voxels_[row].ground; });
    std::vector<Tally> tally(components.size());
    components.visit([&](std::uint32_t component, std::uint32_t row) {
      const Voxel& voxel = voxels_[row];
      tally[component].evidence += voxel.evidence;
      if (voxel.mean > 0.0F) tally[component].dynamic += voxel.evidence.cells;
    });
    const std::vector<CellBox> boxes = components.boxes();
    components.visit([&](std::uint32_t component, std::uint32_t row) {
      Voxel& voxel = voxels_[row];
      voxel.has_component = true;
      voxel.component = class_of(tally[component]);
      voxel.keeps = outline_of(boxes[component], cell_size_m_) == Outline::kPole;
    });
  }

  [[nodiscard]] ComponentClass class_of(const Tally& tally) const {
    return class_by_share(tally.evidence, tally.dynamic, kComponentDynamicShare,
                          EvidenceDefaults::kComponentStaticShare);
  }

  /// A walker beside a wall that came into view with him is a small part of one component.
  void find_moved_parts() {
    const auto may_have_moved = [&](const Voxel& voxel) {
      return voxel.has_component && voxel.component == ComponentClass::kStatic && voxel.mean > 0.0F;
    };
    const VoxelComponents parts(
        blocks_,
        [&](std::uint32_t row) { return voxels_[row].connects && may_have_moved(voxels_[row]); },
        [&](std::uint32_t row) { return may_have_moved(voxels_[row]); });
    std::vector<EvidenceSum> sum(parts.size());
    parts.visit([&](std::uint32_t part, std::uint32_t row) { sum[part] += voxels_[row].evidence; });
    const MovedPart rule{kMovedPartCells, in_thousandths(kMovedPartLogOdds), kMovedPartOccupied};
    parts.visit(
        [&](std::uint32_t part, std::uint32_t row) { voxels_[row].moved = rule.holds(sum[part]); });
  }

  [[nodiscard]] std::vector<std::uint8_t> labels() const {
    std::vector<std::uint8_t> dynamic(cells_.size(), 0);
    for (std::size_t i = 0; i < cells_.size(); ++i) dynamic[i] = is_dynamic(i) ? 1 : 0;
    return dynamic;
  }

  [[nodiscard]] bool is_dynamic(std::size_t cell) const {
    const Voxel& voxel = voxels_[row_of_[cell]];
    if (voxel.ground) return false;
    const bool by_mean = voxel.mean > 0.0F;
    if (!voxel.has_component) return by_mean;
    if (voxel.keeps && cells_.was_dynamic[cell] == 0) return false;
    return is_dynamic_relabelled(
        voxel.component, {by_mean, cells_.log_odds[cell] <= -confirmed_static_, voxel.moved});
  }

  const CellEvidence& cells_;
  float cell_size_m_;
  std::int32_t confirmed_static_;  ///< thousandths
  VoxelBlocks blocks_;
  std::vector<Voxel> voxels_;
  std::vector<std::uint32_t> row_of_;  ///< by cell
};

}  // namespace

std::vector<std::uint8_t> classify_cells(const CellEvidence& cells, float cell_size_m) {
  return CellClassifier(cells, cell_size_m).run();
}

}  // namespace unimapper::merge
