// Which poses do many matched triangles agree on?
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/fixed_vector.hpp"
#include "unimapper/place/config.hpp"
#include "unimapper/place/rigid_fit.hpp"

namespace unimapper {

/// What one matched triangle says: the query stands in `place`, turned and shifted like this.
struct PoseVote {
  std::uint32_t place;
  std::uint16_t turn;         ///< 1/65536 turn, from the query's frame to the place's
  std::int16_t query_cm[2];   ///< centre of the triangle in the query's frame
  std::int16_t stored_cm[2];  ///< the same in the place's frame
  std::uint16_t weight;       ///< at least 1
};

/// A pose that votes for one place agree on.
struct PosePeak {
  std::uint32_t place;
  std::uint32_t support;  ///< sum of the weights
  PlanarPose T_place_query;
};

/// Finds the poses that stand out among very many votes, most of which are chance. True votes for a
/// place agree in turn and shift; chance votes spread over all of them. So votes are counted in two
/// small arrays under a hash of place, turn and shift first, and only those that do not stand alone
/// are looked at one by one: the cost stays linear in the votes, whatever number of places they
/// are spread over.
class PoseVotes {
 public:
  /// Room for `config.max_matches` votes on `config.max_places` places.
  void allocate(Arena& arena, const LoopSearchConfig& config) noexcept;

  void clear() noexcept;

  /// Takes a vote, or refuses and counts when full. O(1).
  void add(const PoseVote& vote) noexcept { votes_.push_back(vote); }

  /// The peaks of every place that has any, in the order in which the places were first voted for.
  /// Valid until `clear()`. Cost: linear in the votes, quadratic in those of one place that do not
  /// stand alone, which are at most `kVotesPerPlace`.
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

  // Where a vote is counted in the two grids.
  struct Slots {
    std::uint32_t in_grid[2];
  };
  // A vote under examination.
  struct Stance {
    PlanarPose pose;
    Eigen::Vector2f query;
    Eigen::Vector2f stored;
    std::uint32_t weight;
    std::uint32_t support;
    bool taken;
  };
  struct Chain {
    std::uint32_t place;
    std::uint32_t first;  // 1 + index into `kept_`
    std::uint32_t last;
  };

  [[nodiscard]] PlanarPose pose_of(const PoseVote& vote) const noexcept;
  [[nodiscard]] Slots slots_of(const PoseVote& vote, std::uint32_t mask) const noexcept;
  void count_votes() noexcept;
  [[nodiscard]] std::uint32_t company_of(std::uint32_t i) const noexcept;
  void keep_those_in_company() noexcept;
  void load_stances(const Chain& chain) noexcept;
  bool add_peak(std::uint32_t place) noexcept;

  FixedVector<PoseVote> votes_;
  std::uint8_t* counts_[2] = {nullptr, nullptr};  // two grids, the second shifted by half a cell
  Slots* slots_ = nullptr;                        // of every vote, in both
  FixedVector<std::uint32_t> kept_;               // votes that do not stand alone
  std::uint32_t* next_ = nullptr;                 // chains of them, 1 + index, 0 ends
  std::uint32_t* chain_of_ = nullptr;             // per place: 1 + index of its chain, 0 none
  FixedVector<Chain> chains_;
  FixedVector<Stance> stances_;
  FixedVector<PosePeak> peaks_;
  float* cosines_ = nullptr;  // of `kTurnSteps` turns
};

}  // namespace unimapper
