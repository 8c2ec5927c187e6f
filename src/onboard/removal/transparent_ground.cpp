#include "transparent_ground.hpp"

#include <algorithm>
#include <utility>

#include "src/core/parts.hpp"

namespace unimapper::onboard {
namespace {

/// A single sample may be a cell that a grazing ray touched.
constexpr std::uint32_t kFewestSamples = 2;

/// True for a quarter of all rows, in no pattern that a scene could share.
bool is_drawn(std::uint32_t row) noexcept { return (row * 0x9E3779B1U) >> 30U == 0; }

}  // namespace

void TransparentGround::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  share_ = config.free_space.visibility ? config.ground.seen_through_share : 0.0F;
  if (!(share_ > 0.0F)) return;
  least_ = in_thousandths(config.removal.log_odds_free);
  executor_ = config.executor;
  samples_ = arena.allocate<Samples>(executor_.workers);
  patches_ = arena.allocate<GroundPatch>(config.voxel.max_voxels);
}

std::uint32_t TransparentGround::reject(const EvidenceWindow& window, const CellTable& cells,
                                        CoarseVoxels& voxels) noexcept {
  if (!(share_ > 0.0F)) return 0;
  std::fill_n(patches_, voxels.map().size(), GroundPatch{});
  std::uint32_t group = 0;
  samples_->size = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if (!is_drawn(row)) continue;
    const std::uint32_t voxel = voxels.of_row(row);
    if (voxel == CoarseVoxels::kNone || !voxels.map()[voxel].ground) continue;
    if (patches_[voxel].cells == kSamplesPerVoxel) continue;
    ++patches_[voxel].cells;
    Samples& samples = samples_[group];
    samples.voxel[samples.size] = voxel;
    samples.x[samples.size] = cells.x()[row];
    samples.y[samples.size] = cells.y()[row];
    samples.z[samples.size] = cells.z()[row];
    samples.log_odds[samples.size] = 0;
    if (++samples.size < kGroup) continue;
    if (++group == executor_.workers) observe(window, cells.grid(), std::exchange(group, 0));
    samples_[group].size = 0;
  }
  observe(window, cells.grid(), group + 1);

  std::uint32_t rejected = 0;
  for (std::uint32_t i = 0; i < voxels.map().size(); ++i) {
    if (!patches_[i].is_transparent(share_, kFewestSamples)) continue;
    voxels.map()[i].ground = false;
    ++rejected;
  }
  return rejected;
}

void TransparentGround::observe(const EvidenceWindow& window, const Grid& grid,
                                std::uint32_t groups) noexcept {
  for_parts(executor_, groups, [&](std::uint32_t group, std::uint32_t) noexcept {
    Samples& samples = samples_[group];
    const ObservedPoints points{samples.x, samples.y, samples.z, samples.log_odds, samples.size};
    for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
      window.earlier(age).observe(1, grid, points);
    }
    window.current().observe(1, grid, points);
  });
  for (std::uint32_t group = 0; group < groups; ++group) {
    const Samples& samples = samples_[group];
    for (std::uint32_t i = 0; i < samples.size; ++i) {
      if (samples.log_odds[i] > least_) ++patches_[samples.voxel[i]].seen_through;
    }
  }
}

}  // namespace unimapper::onboard
