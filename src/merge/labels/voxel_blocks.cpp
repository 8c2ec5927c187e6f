#include "voxel_blocks.hpp"

#include <bit>

namespace unimapper::merge {
namespace {

constexpr std::int32_t kReach = 2;  ///< voxels around one that are summed up
constexpr std::int32_t kReachedEdge = Block::kEdge;
static_assert(kReachedEdge == 2 * kReach, "a neighbour's nearer half is what lies in reach");

constexpr BlockOffset offset_at(std::size_t number) {
  const auto n = static_cast<std::int32_t>(number);
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}

/// Whether a voxel of the block at an offset lies in reach of the block, along one axis.
constexpr bool is_in_reach(std::int32_t voxel, std::int32_t offset) {
  const std::int32_t at = voxel + offset * Block::kEdge + kReach;
  return at >= 0 && at < Block::kEdge + 2 * kReach;
}

/// By offset: the voxels of the block there that lie in reach.
constexpr auto kInReach = [] {
  std::array<std::uint64_t, VoxelBlocks::kAround> masks{};
  for (std::size_t n = 0; n < masks.size(); ++n) {
    const BlockOffset offset = offset_at(n);
    for (std::uint32_t bit = 0; bit < Block::kCells; ++bit) {
      const VoxelIndex v = cell_in({0, 0, 0}, bit);
      if (is_in_reach(v.x, offset.x) && is_in_reach(v.y, offset.y) && is_in_reach(v.z, offset.z)) {
        masks[n] |= std::uint64_t{1} << bit;
      }
    }
  }
  return masks;
}();

/// Place in the cube of a voxel of the block at an offset.
constexpr std::size_t place_in_cube(std::uint32_t bit, const BlockOffset& offset) {
  constexpr std::int32_t kCubeSide = Block::kEdge + 2 * kReach;
  const VoxelIndex v = cell_in({offset.x, offset.y, offset.z}, bit);
  return static_cast<std::size_t>((v.x + kReach) +
                                  kCubeSide * ((v.y + kReach) + kCubeSide * (v.z + kReach)));
}

/// Replaces the first four of eight rows of `Length` numbers by the sums of the five from each on.
template <std::size_t Length, typename Number>
void sum_rows(Number* rows) {
  std::array<Number, Length> sum;
  for (std::size_t i = 0; i < Length; ++i) {
    sum[i] = rows[i] + rows[Length + i] + rows[2 * Length + i] + rows[3 * Length + i];
  }
  for (std::size_t row = 0; row < 4; ++row) {
    Number* const first = rows + row * Length;
    for (std::size_t i = 0; i < Length; ++i) {
      const Number all = sum[i] + first[4 * Length + i];
      sum[i] = all - first[i];
      first[i] = all;
    }
  }
}

}  // namespace

VoxelBlocks::VoxelBlocks(const std::vector<VoxelKey>& voxels) {
  places_.reserve(voxels.size());
  VoxelKey last_key = 0;
  std::uint32_t last = kNone;
  for (const VoxelKey key : voxels) {
    const VoxelIndex voxel = unpack(key);
    const VoxelIndex index = block_of(voxel);
    const VoxelKey block_key = pack(index);
    // Cells that follow each other often share a block.
    if (last == kNone || block_key != last_key) last = table_.find_or_insert(block_key);
    last_key = block_key;
    if (last == blocks_.size()) blocks_.push_back({0, index, 0});
    const std::uint32_t bit = bit_of(voxel);
    blocks_[last].occupied |= std::uint64_t{1} << bit;
    places_.push_back({last, bit});
  }
  for (Block& block : blocks_) {
    block.first = rows_;
    rows_ += popcount(block.occupied);
  }
  find_neighbours();
}

void VoxelBlocks::find_neighbours() {
  std::array<std::uint32_t, kAround> none{};
  none.fill(kNone);
  neighbours_.assign(blocks_.size(), none);
  constexpr std::size_t kSelf = kAround / 2;
  for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
    const VoxelIndex& at = blocks_[b].index;
    neighbours_[b][kSelf] = b;
    // Of two blocks that touch, the one with the lower offset tells the other.
    for (std::size_t n = 0; n < kSelf; ++n) {
      const BlockOffset to = offset_at(n);
      const std::uint32_t other = table_.find(pack({at.x + to.x, at.y + to.y, at.z + to.z}));
      if (other == kNone) continue;
      neighbours_[b][n] = other;
      neighbours_[other][kAround - 1 - n] = b;
    }
  }
}

bool SurroundingSums::leaves_out_near(std::uint32_t b) const {
  if (left_out_ == nullptr) return false;
  const auto& around = blocks_.around(b);
  for (std::size_t n = 0; n < around.size(); ++n) {
    if (around[n] != VoxelBlocks::kNone && (left_out(around[n]) & kInReach[n]) != 0) return true;
  }
  return false;
}

void SurroundingSums::lay_out(std::uint32_t b) {
  log_odds_.fill(0);
  cells_.fill(0);
  const auto& around = blocks_.around(b);
  for (std::size_t n = 0; n < around.size(); ++n) {
    if (around[n] == VoxelBlocks::kNone) continue;
    const Block& block = blocks_.blocks()[around[n]];
    const BlockOffset offset = offset_at(n);
    visit_rows(block, block.occupied & kInReach[n] & ~left_out(around[n]),
               [&](std::uint64_t cell, std::uint32_t row) {
                 const auto bit = static_cast<std::uint32_t>(std::countr_zero(cell));
                 const std::size_t at = place_in_cube(bit, offset);
                 log_odds_[at] = value_[row].log_odds;
                 cells_[at] = value_[row].cells;
               });
  }
}

void SurroundingSums::sum_along_z() {
  sum_rows<kPlane>(log_odds_.data());
  sum_rows<kPlane>(cells_.data());
}

void SurroundingSums::sum_along_y() {
  for (std::size_t z = 0; z < 4; ++z) {
    sum_rows<kSide>(log_odds_.data() + z * kPlane);
    sum_rows<kSide>(cells_.data() + z * kPlane);
  }
}

SurroundingSum SurroundingSums::sum_along_x(std::uint32_t bit) const {
  const std::size_t first = (bit & 3U) + kSide * (bit >> 2U & 3U) + kPlane * (bit >> 4U);
  SurroundingSum sum;
  for (std::size_t i = first; i < first + 5; ++i) {
    sum.log_odds += log_odds_[i];
    sum.cells += cells_[i];
  }
  return sum;
}

}  // namespace unimapper::merge
