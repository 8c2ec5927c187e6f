#include "unimapper/place/pose_votes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "unimapper/core/angles.hpp"
#include "unimapper/core/voxel_key.hpp"

namespace unimapper {
namespace {

// Votes are counted in cells of 11 degrees and 12 m: several times the error of a vote.
constexpr std::uint32_t kTurnCellBits = 11;
constexpr float kShiftCell = 12.0F;
// Two votes agree if they bring the query to the same spot ...
constexpr float kSameShift = 2.5F;
// ... with the same heading: the cosine of 7 degrees.
constexpr float kSameTurn = 0.9925F;
// Votes that do not stand alone, at most; the rest is chance or more than enough.
constexpr std::size_t kMostKept = 8192;

// A vote supports another's pose if that pose brings its triangle to the same spot.
template <typename Stance>
bool agree(const Stance& a, const Stance& b) noexcept {
  if (a.pose.cosine * b.pose.cosine + a.pose.sine * b.pose.sine < kSameTurn) return false;
  return (a.pose * b.query - b.stored).squaredNorm() < kSameShift * kSameShift;
}

}  // namespace

// A peak has two votes, and every vote belongs to one peak.
std::size_t PoseVotes::max_peaks(const LoopSearchConfig& config) noexcept {
  return std::min<std::size_t>(kMostKept, config.max_matches) / 2;
}

void PoseVotes::allocate(Arena& arena, const LoopSearchConfig& config) noexcept {
  votes_.allocate(arena, config.max_matches);
  const std::size_t slots = std::bit_ceil(std::size_t{4} * config.max_matches);
  for (std::uint8_t*& counts : counts_) counts = arena.allocate<std::uint8_t>(slots);
  slots_ = arena.allocate<Slots>(config.max_matches);
  const std::size_t kept = std::min<std::size_t>(kMostKept, config.max_matches);
  kept_.allocate(arena, kept);
  next_ = arena.allocate<std::uint32_t>(kept);
  chain_of_ = arena.allocate<std::uint32_t>(config.max_places);
  chains_.allocate(arena, kept);
  stances_.allocate(arena, kVotesPerPlace);
  peaks_.allocate(arena, max_peaks(config));
  cosines_ = arena.allocate<float>(kTurnSteps);
  if (cosines_ == nullptr) return;
  for (std::uint32_t i = 0; i < kTurnSteps; ++i) {
    const double degrees = static_cast<double>(i) * (360.0 / kTurnSteps);
    // cos x = sin(90 - x), folded into the range of `sin_deg`.
    const double folded = degrees <= 180.0 ? 90.0 - degrees : degrees - 270.0;
    cosines_[i] = static_cast<float>(sin_deg(folded));
  }
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

PoseVotes::Slots PoseVotes::slots_of(const PoseVote& vote, std::uint32_t mask) const noexcept {
  const PlanarPose pose = pose_of(vote);
  Slots slots;
  for (std::uint32_t grid = 0; grid < 2; ++grid) {
    const float half = grid == 0 ? 0.0F : 0.5F;
    const auto turned = static_cast<std::uint16_t>(vote.turn + (grid << (kTurnCellBits - 1)));
    const auto x = static_cast<std::uint32_t>(floor_to_int(pose.x / kShiftCell + half) + 4096);
    const auto y = static_cast<std::uint32_t>(floor_to_int(pose.y / kShiftCell + half) + 4096);
    const std::uint64_t cell = (static_cast<std::uint64_t>(vote.place) << 32U) |
                               (static_cast<std::uint64_t>(turned >> kTurnCellBits) << 26U) |
                               ((x & 0x1FFFU) << 13U) | (y & 0x1FFFU);
    slots.in_grid[grid] = static_cast<std::uint32_t>(mix_bits(cell)) & mask;
  }
  return slots;
}

// Only as many slots are used as the votes need: they are cleared for every search, and stay in
// the cache.
void PoseVotes::count_votes() noexcept {
  const std::size_t used = std::bit_ceil(std::max<std::size_t>(1, std::size_t{4} * votes_.size()));
  for (std::uint8_t* counts : counts_) std::fill_n(counts, used, std::uint8_t{0});
  const auto mask = static_cast<std::uint32_t>(used - 1);
  for (std::uint32_t i = 0; i < votes_.size(); ++i) {
    slots_[i] = slots_of(votes_[i], mask);
    for (int grid = 0; grid < 2; ++grid) {
      std::uint8_t& count = counts_[grid][slots_[i].in_grid[grid]];
      if (count < 255) ++count;
    }
  }
}

// How many votes, the `i`-th included, share the better of its two cells.
std::uint32_t PoseVotes::company_of(std::uint32_t i) const noexcept {
  return std::max(counts_[0][slots_[i].in_grid[0]], counts_[1][slots_[i].in_grid[1]]);
}

// As many as there is room for of those in the largest company.
void PoseVotes::keep_those_in_company() noexcept {
  kept_.clear();
  std::uint32_t votes_with[256] = {};
  for (std::uint32_t i = 0; i < votes_.size(); ++i) ++votes_with[company_of(i)];
  std::uint32_t least = 256;
  std::size_t total = 0;
  while (least > 2 && total + votes_with[least - 1] <= kept_.capacity())
    total += votes_with[--least];
  least = std::min(least, 255U);
  for (std::uint32_t i = 0; i < votes_.size(); ++i) {
    if (company_of(i) < least) continue;
    if (!kept_.push_back(i)) break;
  }
}

std::span<const PosePeak> PoseVotes::peaks() noexcept {
  peaks_.clear();
  chains_.clear();
  if (cosines_ == nullptr) return {};
  count_votes();
  keep_those_in_company();
  for (std::uint32_t i = 0; i < kept_.size(); ++i) {
    const std::uint32_t place = votes_[kept_[i]].place;
    next_[i] = 0;
    std::uint32_t& chain = chain_of_[place];
    if (chain == 0) {
      chains_.push_back({place, i + 1, i + 1});
      chain = static_cast<std::uint32_t>(chains_.size());
    } else {
      next_[chains_[chain - 1].last - 1] = i + 1;
      chains_[chain - 1].last = i + 1;
    }
  }
  for (const Chain& chain : chains_) {
    chain_of_[chain.place] = 0;
    load_stances(chain);
    for (std::uint32_t peak = 0; peak < kPeaksPerPlace; ++peak) {
      if (!add_peak(chain.place)) break;
    }
  }
  return peaks_.view();
}

void PoseVotes::load_stances(const Chain& chain) noexcept {
  stances_.clear();
  for (std::uint32_t i = chain.first; i != 0 && !stances_.full(); i = next_[i - 1]) {
    const PoseVote& vote = votes_[kept_[i - 1]];
    Stance stance;
    stance.pose = pose_of(vote);
    stance.query = Eigen::Vector2f(vote.query_cm[0], vote.query_cm[1]) * 0.01F;
    stance.stored = Eigen::Vector2f(vote.stored_cm[0], vote.stored_cm[1]) * 0.01F;
    stance.weight = vote.weight;
    stance.support = 0;
    stance.taken = false;
    stances_.push_back(stance);
  }
  for (Stance& a : stances_) {
    for (const Stance& b : stances_) a.support += agree(a, b) ? b.weight : 0;
  }
}

// The stance that most others support, as a peak fitted to all of them; they are taken then. False
// if no two are left that agree.
bool PoseVotes::add_peak(std::uint32_t place) noexcept {
  const Stance* best = nullptr;
  for (const Stance& stance : stances_) {
    if (!stance.taken && (best == nullptr || stance.support > best->support)) best = &stance;
  }
  if (best == nullptr) return false;
  const Stance seed = *best;
  Eigen::Vector2f query[kVotesPerPlace];
  Eigen::Vector2f stored[kVotesPerPlace];
  std::uint32_t count = 0;
  for (Stance& stance : stances_) {
    if (stance.taken || !agree(seed, stance)) continue;
    stance.taken = true;
    query[count] = stance.query;
    stored[count] = stance.stored;
    ++count;
  }
  if (count < 2) return false;
  // Triangles that lie far from each other tell the turn better than their sides do; those that lie
  // close together do not, and the seed's own turn stands.
  PosePeak found{place, seed.support, seed.pose};
  PlanarPose fitted;
  if (count >= 3 && fit_planar(query, stored, count, fitted) &&
      agree(seed, Stance{fitted, seed.query, seed.stored, 0, 0, false})) {
    found.T_place_query = fitted;
  }
  peaks_.push_back(found);
  return true;
}

}  // namespace unimapper
