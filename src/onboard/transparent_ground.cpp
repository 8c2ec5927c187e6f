#include "transparent_ground.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// True for a quarter of all rows, in no pattern that a scene could share.
bool is_drawn(std::uint32_t row) noexcept { return (row * 0x9E3779B1U) >> 30U == 0; }

}  // namespace

void TransparentGround::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  share_ = config.free_space.visibility ? config.ground.seen_through_share : 0.0F;
  if (!(share_ > 0.0F)) return;
  judge_ = ImageJudge(config);
  least_ = in_thousandths(config.removal.log_odds_free);
  samples_ = arena.allocate<Samples>(1);
  tally_ = arena.allocate<Tally>(config.voxel.max_voxels);
}

std::uint32_t TransparentGround::reject(const EvidenceWindow& window,
                                        const ImageProjection& projection, const CellTable& cells,
                                        CoarseVoxels& voxels) noexcept {
  if (!(share_ > 0.0F)) return 0;
  std::fill_n(tally_, voxels.map().size(), Tally{0, 0});
  size_ = 0;
  for (std::uint32_t row = 0; row < cells.size(); ++row) {
    if (!is_drawn(row)) continue;
    const std::uint32_t voxel = voxels.of_row(row);
    if (voxel == CoarseVoxels::kNone || !voxels.map()[voxel].ground) continue;
    if (tally_[voxel].asked == kSamplesPerVoxel) continue;
    ++tally_[voxel].asked;
    samples_->voxel[size_] = voxel;
    samples_->x[size_] = cells.x()[row];
    samples_->y[size_] = cells.y()[row];
    samples_->z[size_] = cells.z()[row];
    samples_->log_odds[size_] = 0;
    if (++size_ == kGroup) ask(window, projection, cells.grid());
  }
  ask(window, projection, cells.grid());

  std::uint32_t rejected = 0;
  for (std::uint32_t i = 0; i < voxels.map().size(); ++i) {
    const auto [asked, seen_through] = tally_[i];
    if (asked < 2 || static_cast<float>(seen_through) < share_ * static_cast<float>(asked))
      continue;
    voxels.map()[i].ground = false;
    ++rejected;
  }
  return rejected;
}

void TransparentGround::ask(const EvidenceWindow& window, const ImageProjection& projection,
                            const Grid& grid) noexcept {
  const JudgedPlaces places{samples_->x, samples_->y, samples_->z, samples_->log_odds, size_};
  for (std::uint32_t age = 1; age <= window.earlier_count(); ++age) {
    judge_.add(window.earlier(age), 1, projection, grid, places);
  }
  judge_.add(window.current(), 1, projection, grid, places);
  for (std::uint32_t i = 0; i < size_; ++i) {
    if (samples_->log_odds[i] > least_) ++tally_[samples_->voxel[i]].seen_through;
  }
  size_ = 0;
}

}  // namespace unimapper::onboard
