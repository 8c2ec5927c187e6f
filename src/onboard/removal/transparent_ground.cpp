#include "transparent_ground.hpp"

#include <algorithm>

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
  samples_ = arena.allocate<Samples>(1);
  patches_ = arena.allocate<GroundPatch>(config.voxel.max_voxels);
}

std::uint32_t TransparentGround::reject(const EvidenceWindow& window, const CellTable& cells,
                                        CoarseVoxels& voxels) noexcept {
  if (!(share_ > 0.0F)) return 0;
  std::fill_n(patches_, voxels.map().size(), GroundPatch{});
  size_ = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if (!is_drawn(row)) continue;
    const std::uint32_t voxel = voxels.of_row(row);
    if (voxel == CoarseVoxels::kNone || !voxels.map()[voxel].ground) continue;
    if (patches_[voxel].cells == kSamplesPerVoxel) continue;
    ++patches_[voxel].cells;
    samples_->voxel[size_] = voxel;
    samples_->x[size_] = cells.x()[row];
    samples_->y[size_] = cells.y()[row];
    samples_->z[size_] = cells.z()[row];
    samples_->log_odds[size_] = 0;
    if (++size_ == kGroup) observe(window, cells.grid());
  }
  observe(window, cells.grid());

  std::uint32_t rejected = 0;
  for (std::uint32_t i = 0; i < voxels.map().size(); ++i) {
    if (!patches_[i].is_transparent(share_, kFewestSamples)) continue;
    voxels.map()[i].ground = false;
    ++rejected;
  }
  return rejected;
}

void TransparentGround::observe(const EvidenceWindow& window, const Grid& grid) noexcept {
  const ObservedPoints points{samples_->x, samples_->y, samples_->z, samples_->log_odds, size_};
  for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
    window.earlier(age).observe(1, grid, points);
  }
  window.current().observe(1, grid, points);
  for (std::uint32_t i = 0; i < size_; ++i) {
    if (samples_->log_odds[i] > least_) ++patches_[samples_->voxel[i]].seen_through;
  }
  size_ = 0;
}

}  // namespace unimapper::onboard
