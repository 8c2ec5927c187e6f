// Merged map of two sessions with exact poses.
#pragma once

#include <vector>

#include "unimapper/merge/merger.hpp"

namespace unimapper::merge::testing {

/// Two sessions of six keyframes, ten metres apart along x; the second drives three metres beside
/// the first, and its odometry begins somewhere else.
struct TwoSessions {
  std::vector<SessionData> sessions{2};
  MergeResult result;

  TwoSessions() {
    for (std::size_t s = 0; s < 2; ++s) {
      MergedSession& merged = result.sessions.emplace_back();
      merged.status = s == 0 ? SessionStatus::kCentral : SessionStatus::kMerged;
      for (int k = 0; k < 6; ++k) {
        const Pose T_map_keyframe = at(10.0 * k, 3.0 * static_cast<double>(s), 0.0);
        merged.T_map_keyframe.push_back(T_map_keyframe);
        sessions[s].keyframes.emplace_back().T_odometry_keyframe =
            T_map_odometry(s).inverse() * T_map_keyframe;
      }
    }
  }
  static Pose at(double x, double y, double z) {
    return {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(x, y, z)};
  }
  static Pose T_map_odometry(std::size_t session) {
    return session == 0 ? Pose() : at(100.0, -40.0, 2.0);
  }
  /// An accepted loop that fits, with these deviations in metres and radians.
  LoopConstraint& loop(KeyframeId query, KeyframeId match, double sigma_m, double sigma_rad) {
    LoopConstraint& loop = result.loops.emplace_back();
    loop.query = query;
    loop.match = match;
    loop.T_match_query = result.sessions[match.session].T_map_keyframe[match.keyframe].inverse() *
                         result.sessions[query.session].T_map_keyframe[query.keyframe];
    loop.information.setZero();
    loop.information.diagonal() << 1.0, 1.0, 1.0, 0.0, 0.0, 0.0;
    loop.information *= 1.0 / (sigma_m * sigma_m);
    loop.information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 /
                                                                      (sigma_rad * sigma_rad));
    loop.decision.accepted = true;
    return loop;
  }
};

}  // namespace unimapper::merge::testing
