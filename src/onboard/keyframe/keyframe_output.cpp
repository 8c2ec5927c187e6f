#include "keyframe_output.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "src/onboard/removal/ground.hpp"

namespace unimapper::onboard {
namespace {

using Lanes = float __attribute__((vector_size(16)));

Lanes lanes(const Eigen::Vector3f& v) noexcept { return Lanes{v.x(), v.y(), v.z(), 0.0F}; }

std::uint16_t saturated(std::uint32_t points) noexcept {
  return static_cast<std::uint16_t>(std::min(points, 65535U));
}

}  // namespace

void KeyframeOutput::allocate_labels(Arena& arena, const PipelineConfig& config) noexcept {
  ground_ = config.ground;
  executor_ = config.executor;
  slice_blocks_ = slice_size(config, 4096);
  feet_.allocate(arena, config);
  entries_ = static_cast<std::uint32_t>(CellStore::max_entries(config.voxel));
  dynamic_from_ = arena.allocate<std::uint32_t>(std::size_t{entries_} / 2 + 1);
  width_ = widest_vectors();
}

void KeyframeOutput::allocate_cells(Arena& arena, const PipelineConfig& config) noexcept {
  capacity_ = config.voxel.max_cells;
  cells_ = arena.allocate<FineCell>(capacity_);
  cells_before_ = config.deferred ? arena.allocate<FineCell>(capacity_) : cells_;
}

void KeyframeOutput::begin(const BlockWindow& window, const CellTable& cells,
                           const Pose& T_odometry_keyframe,
                           const IntensitySum* intensities) noexcept {
  intensities_ = intensities;
  R_keyframe_grid_ = T_odometry_keyframe.rotation.transpose().cast<float>();
  t_keyframe_grid_ = (T_odometry_keyframe.rotation.transpose() *
                      (cells.grid().origin_m() - T_odometry_keyframe.translation))
                         .cast<float>();
  std::swap(cells_, cells_before_);
  static_count_ = 0;
  dynamic_count_ = 0;
  std::fill_n(dynamic_from_, entries_ / 2 + 1, kAboveCell | kAboveCell << 16U);
  feet_.find(window, cells);
  loop_.begin();
}

bool KeyframeOutput::step(const BlockWindow& window, const CellTable& cells,
                          const CoarseVoxels& voxels) noexcept {
  const std::span<const Block> blocks = cells.blocks();
  const Slice some = loop_.next(static_cast<std::uint32_t>(blocks.size()), slice_blocks_);
  const Cut cut(executor_, some, kBlocksPerPart);
  std::uint32_t dynamic[Cut::kMost];
  count_before(executor_, cut, dynamic_count_, dynamic, [&](Slice part) noexcept {
    std::uint32_t count = 0;
    for (std::uint32_t b = part.first; b < part.end; ++b) {
      count += popcount(cells.marks(b).dynamic & blocks[b].occupied);
    }
    return count;
  });
  for_parts(executor_, cut.parts(), [&](std::uint32_t part, std::uint32_t) noexcept {
    const Ends ends = add_blocks(cut[part], dynamic[part], window, cells, voxels);
    if (cut[part].end < some.end) return;
    static_count_ = static_cast<std::uint32_t>(ends.next_static - cells_);
    dynamic_count_ = static_cast<std::uint32_t>(cells_ + capacity_ - ends.last_dynamic);
  });
  return !loop_.is_over();
}

KeyframeOutput::Ends KeyframeOutput::add_blocks(Slice some, std::uint32_t dynamic_before,
                                                const BlockWindow& window, const CellTable& cells,
                                                const CoarseVoxels& voxels) noexcept {
  Ends ends{cells_ + (cells.blocks()[some.first].first - dynamic_before),
            cells_ + (capacity_ - dynamic_before)};
  for (std::uint32_t b = some.first; b < some.end; ++b) {
    ends = add_block(b, ends, window, cells, voxels);
  }
  return ends;
}

KeyframeOutput::Ends KeyframeOutput::add_block(std::uint32_t b, Ends ends,
                                               const BlockWindow& window, const CellTable& cells,
                                               const CoarseVoxels& voxels) noexcept {
  // Columns of the rotation: summed up in the order in which Eigen multiplies.
  const Lanes x = lanes(R_keyframe_grid_.col(0));
  const Lanes y = lanes(R_keyframe_grid_.col(1));
  const Lanes z = lanes(R_keyframe_grid_.col(2));
  const Lanes t = lanes(t_keyframe_grid_);
  const Block& block = cells.blocks()[b];
  const CellMarks& marks = cells.marks(b);
  const std::uint64_t feet = feet_.cells_of(b, marks);
  std::uint64_t left = block.occupied;
  for (std::uint32_t row = block.first; left != 0; ++row, left &= left - 1) {
    const std::uint64_t cell = lowest_bit(left);
    const bool dynamic = (marks.dynamic & cell) != 0;
    const std::uint8_t intensity =
        intensities_ == nullptr ? std::uint8_t{0} : intensities_[cells.entry(row)].mean();
    const Lanes p = x * cells.x()[row] + (y * cells.y()[row] + z * cells.z()[row]) + t;
    FineCell& made = dynamic ? *--ends.last_dynamic : *ends.next_static++;
    made = {{p[0], p[1], p[2]},
            saturated(cells.points(row)),
            static_cast<std::uint8_t>((marks.ground & cell) != 0),
            intensity};
    if (((marks.dynamic | feet) & cell) == 0) continue;
    set_dynamic_from(cells.entry(row), (feet & cell) != 0
                                           ? feet_.level_in_cell(window, voxels, cells, row)
                                           : ground_level_in_cell(ground_, voxels, cells, row));
  }
  return ends;
}

std::uint64_t KeyframeOutput::count_dynamic(const ScanAccumulator& scans) const noexcept {
  std::uint32_t dynamic[KeyframeConfig::kMaxScans];
  for_parts(executor_, scans.scans(), [&](std::uint32_t scan, std::uint32_t) noexcept {
    const std::span<const PointCode> codes = scans.codes(scan);
    std::uint32_t& count = dynamic[scan];
    run_vectorised(width_, [&]() UNIMAPPER_VECTORISED {
      const std::uint32_t* const pairs = dynamic_from_;
      const std::uint32_t no_cell = entries_;
      const PointCode* const code = codes.data();
      const std::size_t size = codes.size();
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i < size; ++i) {
        // Without branches: codes that name no cell are looked up behind all cells.
        const std::uint32_t cell = cell_of(code[i]);
        const std::uint32_t from = dynamic_from(pairs, cell < no_cell ? cell : no_cell);
        sum += height_of(code[i]) >= from ? 1U : 0U;
      }
      count = sum;
    });
  });
  return std::accumulate(dynamic, dynamic + scans.scans(), std::uint64_t{0});
}

}  // namespace unimapper::onboard
