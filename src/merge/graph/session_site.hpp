// Sessions placed in the site frame by their own positions, and loops compared with that.
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "map_graph.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Reason against positions that no session fits.
inline constexpr const char* kNoSite = "no placement of the session fits its positions";

/// Positions of one session that agree with each other and with its odometry.
struct SessionPositions {
  std::vector<KnownPosition> used;        ///< none: the session has no site
  std::vector<PositionOutcome> rejected;  ///< with the reason
};

/// A session in the site frame, by its own positions and nothing else.
class SessionSite {
 public:
  /// `placed`: the session alone, optimised with these positions.
  SessionSite(const MapState& placed, std::size_t session, std::vector<KnownPosition> used);

  /// Pose of a keyframe, levelled keyframe frame to site frame.
  [[nodiscard]] const Pose& pose(std::size_t keyframe) const { return T_site_keyframe_[keyframe]; }
  /// Variances of its position: one horizontal axis (infinite: unknown) and z. Of the position
  /// nearest by odometry, its drift from there, and heading and up over the distance.
  struct Variance {
    double horizontal = std::numeric_limits<double>::infinity();
    double vertical = std::numeric_limits<double>::infinity();
  };
  [[nodiscard]] Variance variance(std::size_t keyframe) const;
  /// Variance of the heading, square radians.
  [[nodiscard]] double heading_variance() const { return heading_variance_; }

 private:
  std::vector<Pose> T_site_keyframe_;
  SessionPath path_;
  std::vector<KnownPosition> used_;
  double heading_variance_;
  double up_variance_;
};

/// Of the positions of a session, the largest set in which every two agree with each other by what
/// odometry says of the distance and the height between them, if it is more than half of them; then
/// all that agree with the session optimised with those. `state` has the session's poses corrected
/// by its loops; `loops` are those. `placed` is that optimisation, if there are any. O(n^2) in the
/// positions compared, at most 200, spread evenly.
SessionPositions choose_positions(const MapState& state, std::size_t session,
                                  const std::vector<KnownPosition>& positions,
                                  std::span<const LoopConstraint> loops, const MergeConfig& config,
                                  MapState& placed);

/// A loop compared with the sites of its two sessions.
struct SiteComparison {
  Eigen::Vector3d discrepancy_m = Eigen::Vector3d::Zero();  ///< of the query's place, site frame
  SessionSite::Variance variance;                           ///< of the discrepancy
  double chi2 = 0.0;                                        ///< of what is known of the discrepancy
};
[[nodiscard]] SiteComparison compare_with_sites(const LoopConstraint& loop,
                                                const SessionSite& query, const SessionSite& match);

/// How far off a set of consistent loops is, if it contradicts the positions: by those of its loops
/// of whose place these know most, along the ground and in height. Odometry ties the others to
/// them.
[[nodiscard]] std::optional<double> set_contradiction_m(std::span<const LoopConstraint> loops,
                                                        const SessionSite& query,
                                                        const SessionSite& match);

/// How far from a placement by loops the positions exclude any other one.
[[nodiscard]] ExcludedBeyond excluded_beyond(std::span<const LoopConstraint> loops,
                                             const SessionSite& query, const SessionSite& match);

/// "12 of 12 loops contradict the known positions of both sessions, by 41.0 m".
[[nodiscard]] std::string contradiction_text(std::vector<double> distances_m, std::size_t loops);

}  // namespace unimapper::merge
