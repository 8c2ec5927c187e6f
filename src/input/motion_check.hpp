// Scans against poses: which motion neighbouring scans agree with
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "src/input/agreement.hpp"
#include "src/input/pose_mistakes.hpp"
#include "src/input/stamps.hpp"

namespace unimapper::input {

/// Which pairs of scans to compare.
struct PairIndex {
  std::size_t first = 0;
  std::size_t second = 0;
};

/// At most `most` pairs spread over the track: half of them neighbours, half so far apart that the
/// sensor moved by a metre or turned by eight degrees, at most ten scans, where it turns most.
[[nodiscard]] std::vector<PairIndex> choose_pairs(const Track& track, std::size_t most);

/// How well scans agree under the given motion and under others, means over the pairs that say
/// something; 0 to 1.
struct AgreementFigures {
  std::size_t pairs = 0;        ///< that say something
  double given = 0.0;           ///< under the recording's poses
  double registered = 0.0;      ///< under what a registration finds, from the given motion or none
  double identity = 0.0;        ///< without any motion
  double given_motion_m = 0.0;  ///< median, between the scans of a pair
  double correction_m = 0.0;    ///< median, of registration against the given motion
  double correction_deg = 0.0;
  double length_ratio = 1.0;  ///< of the given motions over those that a registration finds
  /// Pairs that agree under no motion, not even half as well as pairs usually do.
  std::size_t disjoint_pairs = 0;
  PairIndex least_agreeing{};     ///< the one that agrees least
  double least_of_usual = 0.0;    ///< its agreement under the best motion over that of usual pairs
  double least_agreeing_m = 0.0;  ///< that the sensor drove between the two, by its poses
  double drift_m = 0.0;           ///< of the middle of the scans in their own frame, the largest
  double displacement_m = 0.0;    ///< of the sensor by its poses, the largest
  /// How much more the points' elevations concentrate in rings after the inverse of the scans'
  /// poses; above 1 where the scans are in the world frame. 0: not measured.
  double ring_gain = 0.0;
  /// How much more the points of the first scan concentrate in rings than those of later ones; far
  /// above 1 where the scans are in the world frame and the first is at its origin. 0: not
  /// measured.
  double ring_loss = 0.0;
  std::string mistake;    ///< the known mistake that explains best; empty: none looked for
  double mistaken = 0.0;  ///< agreement with that mistake undone
  std::vector<std::string> remedies;  ///< of that mistake and those that explain as well
  /// Those correct each pose by itself: none is a scale or an order.
  bool is_by_pose = true;
  bool slides = false;  ///< registration of most pairs slides, as along a bore
  /// Scans so many apart agree under the given poses, neighbours do not: LiDARs take turns. 0: no.
  std::size_t turns = 0;
  double in_turn = 0.0;     ///< agreement of scans `turns` apart
  double neighbours = 0.0;  ///< agreement of neighbours beside them
};

/// Known mistakes are tried where a registration finds so much more agreement.
inline constexpr double kTryMistakes = 0.04;

/// How well a pair agrees under motions.
struct Agreements {
  double given = 0.0;
  double registered = 0.0;
  double identity = 0.0;  ///< without any
};

/// Collects the figures of pairs, all but those of whole tracks and of mistakes.
class AgreementMeans {
 public:
  /// A pair that says something, with its given motion and the one that a registration finds.
  void add(const PairIndex& pair, const Pose& given, const Pose& registered,
           const Agreements& agreements);
  [[nodiscard]] AgreementFigures figures() &&;

 private:
  void count_disjoint_pairs();

  AgreementFigures figures_;  ///< sums
  std::vector<PairIndex> pairs_;
  std::vector<double> best_;
  std::vector<double> given_m_;
  std::vector<double> corrections_m_;
  std::vector<double> corrections_deg_;
  double registered_sum_m_ = 0.0;
};

/// Compares pairs. Known mistakes are tried only where the given motion does not agree.
[[nodiscard]] AgreementFigures measure_agreement(std::span<const ScanPair> pairs,
                                                 const Track& track,
                                                 const std::vector<PoseMistake>& mistakes);

/// Sets `turns` where scans two or three apart agree better than neighbours, which other faults of
/// poses do not do. Reads up to 32 scans, by `shape`; where three looks hint at none, twelve.
void find_turns(const Track& track,
                const std::function<std::shared_ptr<const ScanShape>(std::size_t)>& shape,
                AgreementFigures& figures);

/// Whether all `pairs` tell and agree so well that scans of more points would tell nothing else.
[[nodiscard]] bool is_surely_right(const AgreementFigures& agreement, std::size_t pairs);

}  // namespace unimapper::input
