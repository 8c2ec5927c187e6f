#include "pose_votes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "src/core/voxel_key.hpp"
#include "unimapper/core/angles.hpp"

namespace unimapper::place {
namespace {

// Votes are counted in cells of 11 degrees and 12 m: several times the error of a vote.
constexpr std::uint32_t kTurnCellBits = 11;
constexpr float kShiftCell = 12.0F;
// Two votes agree if they bring the query's triangle to the same position ...
constexpr float kSameShift = 2.5F;
// ... with the same heading: the cosine of 7 degrees.
constexpr float kSameTurn = 0.9925F;
// Supported votes, at most; the rest is chance or more than enough.
constexpr std::size_t kMostKept = 8192;

// A vote supports another's pose if that pose brings its triangle to the same position.
template <typename PoseSample>
bool agree(const PoseSample& a, const PoseSample& b) noexcept {
  if (a.pose.cosine * b.pose.cosine + a.pose.sine * b.pose.sine < kSameTurn) return false;
  return (a.pose * b.query - b.stored).squaredNorm() < kSameShift * kSameShift;
}

}  // namespace

// A peak has two votes, and every vote belongs to one peak.
std::size_t PoseVotes::max_peaks(const LoopSearchConfig& config) noexcept {
  return std::min<std::size_t>(kMostKept, config.max_matches) / 2;
}

void PoseVotes::allocate_kept(Arena& arena, const LoopSearchConfig& config) noexcept {
  chain_of_ = arena.allocate<std::uint32_t>(config.max_places);
  cosines_ = arena.allocate<float>(kTurnSteps);
  if (cosines_ == nullptr) return;
  for (std::uint32_t i = 0; i < kTurnSteps; ++i) {
    const double degrees = static_cast<double>(i) * (360.0 / kTurnSteps);
    // cos x = sin(90 - x), folded into the range of `sin_deg`.
    const double folded = degrees <= 180.0 ? 90.0 - degrees : degrees - 270.0;
    cosines_[i] = static_cast<float>(sin_deg(folded));
  }
}

void PoseVotes::allocate_scratch(Arena& arena, const LoopSearchConfig& config) noexcept {
  votes_.allocate(arena, config.max_matches);
  const std::size_t cells = std::bit_ceil(std::size_t{4} * config.max_matches);
  for (std::uint8_t*& counts : counts_) counts = arena.allocate<std::uint8_t>(cells);
  cells_ = arena.allocate<Cells>(config.max_matches);
  const std::size_t kept = std::min<std::size_t>(kMostKept, config.max_matches);
  kept_.allocate(arena, kept);
  next_ = arena.allocate<std::uint32_t>(kept);
  chains_.allocate(arena, kept);
  samples_.allocate(arena, kVotesPerPlace);
  peaks_.allocate(arena, max_peaks(config));
}

void PoseVotes::clear() noexcept {
  votes_.clear();
  votes_.reset_refused();
}

PlanarPose PoseVotes::pose_of(const PoseVote& vote) const noexcept {
  const std::uint32_t step = ((vote.turn + 32U) >> 6U) & (kTurnSteps - 1);
  PlanarPose pose;
  pose.cosine = cosines_[step];
  pose.sine = cosines_[(step + 3 * kTurnSteps / 4) & (kTurnSteps - 1)];
  const float qx = static_cast<float>(vote.query_cm[0]) * 0.01F;
  const float qy = static_cast<float>(vote.query_cm[1]) * 0.01F;
  pose.x = static_cast<float>(vote.stored_cm[0]) * 0.01F - (pose.cosine * qx - pose.sine * qy);
  pose.y = static_cast<float>(vote.stored_cm[1]) * 0.01F - (pose.sine * qx + pose.cosine * qy);
  return pose;
}

PoseVotes::Cells PoseVotes::cells_of(const PoseVote& vote, std::uint32_t mask) const noexcept {
  const PlanarPose pose = pose_of(vote);
  Cells cells;
  for (std::uint32_t grid = 0; grid < 2; ++grid) {
    const float half = grid == 0 ? 0.0F : 0.5F;
    const auto turned = static_cast<std::uint16_t>(vote.turn + (grid << (kTurnCellBits - 1)));
    const auto x = static_cast<std::uint32_t>(floor_to_int(pose.x / kShiftCell + half) + 4096);
    const auto y = static_cast<std::uint32_t>(floor_to_int(pose.y / kShiftCell + half) + 4096);
    const std::uint64_t cell = (static_cast<std::uint64_t>(vote.slot) << 32U) |
                               (static_cast<std::uint64_t>(turned >> kTurnCellBits) << 26U) |
                               ((x & 0x1FFFU) << 13U) | (y & 0x1FFFU);
    cells.in_grid[grid] = static_cast<std::uint32_t>(mix_bits(cell)) & mask;
  }
  return cells;
}

// Only as many cells are used as the votes need: they are cleared for every search, and stay in
// the cache.
void PoseVotes::count_votes() noexcept {
  const std::size_t used = std::bit_ceil(std::max<std::size_t>(1, std::size_t{4} * votes_.size()));
  for (std::uint8_t* counts : counts_) std::fill_n(counts, used, std::uint8_t{0});
  const auto mask = static_cast<std::uint32_t>(used - 1);
  for (std::uint32_t i = 0; i < votes_.size(); ++i) {
    cells_[i] = cells_of(votes_[i], mask);
    for (int grid = 0; grid < 2; ++grid) {
      std::uint8_t& count = counts_[grid][cells_[i].in_grid[grid]];
      if (count < 255) ++count;
    }
  }
}

// How many votes, the `i`-th included, share the better of its two cells.
std::uint32_t PoseVotes::support_of(std::uint32_t i) const noexcept {
  return std::max(counts_[0][cells_[i].in_grid[0]], counts_[1][cells_[i].in_grid[1]]);
}

// The votes with support, those with most of it first where not all fit.
void PoseVotes::keep_supported() noexcept {
  kept_.clear();
  std::uint32_t votes_with[256] = {};
  for (std::uint32_t i = 0; i < votes_.size(); ++i) ++votes_with[support_of(i)];
  std::uint32_t least = 256;
  std::size_t total = 0;
  while (least > 2 && total + votes_with[least - 1] <= kept_.capacity())
    total += votes_with[--least];
  least = std::min(least, 255U);
  for (std::uint32_t i = 0; i < votes_.size(); ++i) {
    if (support_of(i) < least) continue;
    if (!kept_.push_back(i)) break;
  }
}

std::span<const PosePeak> PoseVotes::peaks() noexcept {
  peaks_.clear();
  chains_.clear();
  if (cosines_ == nullptr) return {};
  count_votes();
  keep_supported();
  for (std::uint32_t i = 0; i < kept_.size(); ++i) {
    const std::uint32_t slot = votes_[kept_[i]].slot;
    next_[i] = 0;
    std::uint32_t& chain = chain_of_[slot];
    if (chain == 0) {
      chains_.push_back({slot, i + 1, i + 1});
      chain = static_cast<std::uint32_t>(chains_.size());
    } else {
      next_[chains_[chain - 1].last - 1] = i + 1;
      chains_[chain - 1].last = i + 1;
    }
  }
  for (const Chain& chain : chains_) {
    chain_of_[chain.slot] = 0;
    load_samples(chain);
    for (std::uint32_t peak = 0; peak < kPeaksPerPlace; ++peak) {
      if (!add_peak(chain.slot)) break;
    }
  }
  return peaks_.view();
}

void PoseVotes::load_samples(const Chain& chain) noexcept {
  samples_.clear();
  for (std::uint32_t i = chain.first; i != 0 && !samples_.full(); i = next_[i - 1]) {
    const PoseVote& vote = votes_[kept_[i - 1]];
    PoseSample sample;
    sample.pose = pose_of(vote);
    sample.query = Eigen::Vector2f(vote.query_cm[0], vote.query_cm[1]) * 0.01F;
    sample.stored = Eigen::Vector2f(vote.stored_cm[0], vote.stored_cm[1]) * 0.01F;
    sample.weight = vote.weight;
    sample.support = 0;
    sample.assigned = false;
    samples_.push_back(sample);
  }
  for (PoseSample& a : samples_) {
    for (const PoseSample& b : samples_) a.support += agree(a, b) ? b.weight : 0;
  }
}

// The sample with most support, as a peak fitted to all that support it; they are assigned to it.
// False if no two are left that agree.
bool PoseVotes::add_peak(std::uint32_t slot) noexcept {
  const PoseSample* best = nullptr;
  for (const PoseSample& sample : samples_) {
    if (!sample.assigned && (best == nullptr || sample.support > best->support)) best = &sample;
  }
  if (best == nullptr) return false;
  const PoseSample seed = *best;
  Eigen::Vector2f query[kVotesPerPlace];
  Eigen::Vector2f stored[kVotesPerPlace];
  std::uint32_t count = 0;
  for (PoseSample& sample : samples_) {
    if (sample.assigned || !agree(seed, sample)) continue;
    sample.assigned = true;
    query[count] = sample.query;
    stored[count] = sample.stored;
    ++count;
  }
  if (count < 2) return false;
  // Triangles far from each other determine the turn better than their sides do; those close
  // together do not, and the seed's own turn is kept.
  PosePeak found{slot, seed.support, seed.pose};
  PlanarPose fitted;
  if (count >= 3 && fit_planar(query, stored, count, fitted) &&
      agree(seed, PoseSample{fitted, seed.query, seed.stored, 0, 0, false})) {
    found.T_place_query = fitted;
  }
  peaks_.push_back(found);
  return true;
}

}  // namespace unimapper::place
