// Loops in, aligned maps out: no sensor data, so any front end can feed it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "unimapper/merge/loop_acceptance.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/session_path.hpp"

namespace unimapper::merge {

/// What became of one loop.
struct LoopVerdict {
  bool accepted = false;
  std::string reason;  ///< why not, empty if accepted
};

/// One session for the aligner.
struct AlignmentSession {
  std::vector<Pose> T_odometry_keyframe;
  double central_score = 0.0;  ///< how well it would serve as the central map; larger is better
};

/// The state of all maps after alignment.
struct Alignment {
  std::size_t central = 0;
  std::vector<bool> connected;                        ///< false: kept apart, in its own frame
  std::vector<std::string> reason;                    ///< why a session is not connected
  std::vector<Pose> T_map_session;                    ///< anchor nodes
  std::vector<std::vector<Pose>> T_session_keyframe;  ///< optimised, in the session's own frame
  std::vector<LoopVerdict> verdicts;                  ///< of the loops given, in their order

  /// Pose of a keyframe in the frame of the merged map.
  [[nodiscard]] Pose T_map_keyframe(KeyframeRef k) const {
    return T_map_session[k.session] * T_session_keyframe[k.session][k.keyframe];
  }
};

/// Optimises every session with its own loops (paper section V-C), votes per pair of sessions,
/// then joins maps one pair at a time, strongest first, starting from the central map
/// (section VI). Every join is a transaction: it is solved, audited, and rolled back if its
/// loops do not survive or if it bends a map more than its odometry could explain. Sessions
/// that nothing trustworthy connects stay apart. Deterministic.
Alignment align_sessions(const std::vector<AlignmentSession>& sessions,
                         std::span<const LoopConstraint> loops, const MergeConfig& config);

/// Adds loops found between maps that `align_sessions` has connected (radius search), drops
/// what disagrees, gives loops refused earlier a second chance, and solves once more. `loops`
/// are all loops, the earlier ones first; their verdicts are carried over and extended.
Alignment refine_alignment(const Alignment& start, const std::vector<AlignmentSession>& sessions,
                           std::span<const LoopConstraint> loops, const MergeConfig& config);

}  // namespace unimapper::merge
