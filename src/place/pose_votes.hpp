// Pose voting: peaks of the poses that matched triangles imply.
#pragma once

#include <cstdint>
#include <span>

#include "src/core/fixed_vector.hpp"
#include "src/core/rigid_fit.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// The planar pose that one matched triangle implies.
struct PoseVote {
  std::uint32_t slot;         ///< of the stored place
  std::uint16_t turn;         ///< 1/65536 turn, from the query's frame to the place's
  std::int16_t query_cm[2];   ///< centre of the triangle in the query's frame
  std::int16_t stored_cm[2];  ///< centre of the triangle in the place's frame
  std::uint16_t weight;       ///< at least 1
};

/// A pose that votes for one place agree on.
struct PosePeak {
  std::uint32_t slot;     ///< of the place
  std::uint32_t support;  ///< sum of the weights
  PlanarPose T_place_query;
};

/// Finds the poses that stand out among very many votes, most of which are chance. True votes for a
/// place agree in turn and shift; chance votes spread over all of them. So votes are counted in two
/// hashed histograms of place, turn and shift first, and only those that share a cell with others
/// are compared pairwise: the cost stays linear in the votes, whatever number of places they are
/// spread over.
class PoseVotes {
 public:
  /// Room for `config.max_matches` votes on `config.max_places` places.
  void allocate(Arena& arena, const LoopSearchConfig& config) noexcept {
    allocate_kept(arena, config);
    allocate_scratch(arena, config);
  }
  /// The two parts of it: the second is in use only from `clear` to the last look at `peaks`.
  void allocate_kept(Arena& arena, const LoopSearchConfig& config) noexcept;
  void allocate_scratch(Arena& arena, const LoopSearchConfig& config) noexcept;

  void clear() noexcept;

  /// Takes a vote, or refuses and counts when full. O(1).
  void add(const PoseVote& vote) noexcept { votes_.push_back(vote); }

  /// The peaks of every place that has any, in the order in which the places were first voted for.
  /// Valid until `clear()`. Cost: linear in the votes, quadratic in the supported ones of one
  /// place, which are at most `kVotesPerPlace`.
  [[nodiscard]] std::span<const PosePeak> peaks() noexcept;

  /// Most peaks there can be.
  [[nodiscard]] static std::size_t max_peaks(const LoopSearchConfig& config) noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return votes_.size(); }
  /// Votes refused since `clear()`.
  [[nodiscard]] std::uint64_t refused() const noexcept { return votes_.refused(); }

 private:
  static constexpr std::uint32_t kVotesPerPlace = 128;
  static constexpr std::uint32_t kPeaksPerPlace = 2;
  static constexpr std::uint32_t kTurnSteps = 1024;

  // The cells of the two histograms that count a vote.
  struct Cells {
    std::uint32_t in_grid[2];
  };
  // A vote as a pose, with the sum of the weights that agree with it.
  struct PoseSample {
    PlanarPose pose;
    Eigen::Vector2f query;
    Eigen::Vector2f stored;
    std::uint32_t weight;
    std::uint32_t support;
    bool assigned;  // to a peak
  };
  struct Chain {
    std::uint32_t slot;
    std::uint32_t first;  // 1 + index into `kept_`
    std::uint32_t last;
  };

  [[nodiscard]] PlanarPose pose_of(const PoseVote& vote) const noexcept;
  [[nodiscard]] Cells cells_of(const PoseVote& vote, std::uint32_t mask) const noexcept;
  void count_votes() noexcept;
  [[nodiscard]] std::uint32_t support_of(std::uint32_t i) const noexcept;
  void keep_supported() noexcept;
  void load_samples(const Chain& chain) noexcept;
  bool add_peak(std::uint32_t slot) noexcept;

  FixedVector<PoseVote> votes_;
  std::uint8_t* counts_[2] = {nullptr,
                              nullptr};  // two histograms, the second shifted by half a cell
  Cells* cells_ = nullptr;               // of every vote, in both
  FixedVector<std::uint32_t> kept_;      // supported votes
  std::uint32_t* next_ = nullptr;        // chains of them, 1 + index, 0 ends
  std::uint32_t* chain_of_ = nullptr;    // per slot: 1 + index of its chain, 0 none
  FixedVector<Chain> chains_;
  FixedVector<PoseSample> samples_;
  FixedVector<PosePeak> peaks_;
  float* cosines_ = nullptr;  // of `kTurnSteps` turns
};

}  // namespace unimapper::place
