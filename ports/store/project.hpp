// Parts of a stored project: epochs, statements of people, results of merges.
#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::store {

/// A keyframe of a stored session.
struct KeyframeRow {
  std::int64_t session = 0;    ///< row of its session
  std::uint32_t sequence = 0;  ///< of the keyframe within its session
  friend auto operator<=>(const KeyframeRow&, const KeyframeRow&) = default;
};

/// What a person may say.
enum class StatementKind : std::uint8_t {
  kLink,       ///< two keyframes show the same surroundings
  kForbidden,  ///< a loop between two keyframes is wrong
  kApart,      ///< a session stays apart from the map
  kReference,  ///< a session's frame is the map's
  kPosition,   ///< positions of keyframes of a session are known
};

/// "link", "forbidden", "apart", "reference" or "position": the word in the table.
const char* kind_name(StatementKind kind);

/// A known position of a keyframe, site frame, metres.
struct StoredPosition {
  std::uint32_t sequence = 0;                          ///< of the keyframe within its session
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< x and y are 0 if only z is known
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< sensor frame at the reference scan
  std::optional<double> sigma_xy_m;                    ///< of x and of y; none: not known
  double sigma_z_m = 0.0;                              ///< of z
};

/// One statement; those of sessions use `match.session` only.
struct StoredStatement {
  std::int64_t id = 0;                         ///< row; 0: not stored yet
  StatementKind kind = StatementKind::kApart;  ///< what is said
  KeyframeRow match;                           ///< the session or keyframe it is said of
  KeyframeRow query;                           ///< of a link or loop: the other keyframe
  std::optional<Pose> T_match_query;        ///< of a link: between sensors at the reference scans
  std::vector<StoredPosition> positions{};  ///< of known positions: ascending, one at least
};

/// One change of the project.
struct Epoch {
  std::int64_t number = 0;          ///< from 1; 0: before the first
  std::int64_t parent = 0;          ///< the epoch it changed; of an undo the one gone back to
  std::int64_t made_s = 0;          ///< Unix time
  std::string command;              ///< what was asked for, in words
  std::string outcome;              ///< what came of it, in words
  std::int64_t known_sessions = 0;  ///< largest row of a session that it knew of
  std::int64_t result = 0;          ///< of the latest merge that it shows; 0: none
  std::int64_t purged_by = 0;       ///< the epoch that removed a session of it for good; 0: none
};

/// The project as of one epoch.
struct ProjectState {
  Epoch epoch;                              ///< number 0 where there is none yet
  std::vector<std::int64_t> sessions;       ///< rows of its sessions, ascending
  std::vector<StoredStatement> statements;  ///< in effect, ascending
  std::string crs;                          ///< coordinate system of the site; empty: not said
};

/// A session in the result of a merge.
struct SessionResult {
  std::int64_t session = 0;  ///< row
  std::string state;         ///< the word of `merge::status_name`
  /// Why it is not connected, or what is wrong with its odometry; else empty.
  std::string reason;
  Pose T_map_session;                    ///< anchor: session odometry frame to the map frame
  std::vector<std::uint32_t> sequences;  ///< keyframes that were merged, ascending
  std::vector<Pose> T_map_keyframe;      ///< levelled keyframe frame to map frame, by `sequences`
};

/// A loop in the result of a merge, or an outcome of its verification.
struct LoopResult {
  KeyframeRow query;   ///< the keyframe that was searched for
  KeyframeRow match;   ///< the keyframe that was found
  Pose T_match_query;  ///< between levelled keyframe frames
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity();
  double overlap = 0.0;     ///< share of structure that coincides
  float confidence = 0.0F;  ///< of the search
  bool accepted = false;    ///< the decision
  bool by_person = false;   ///< a person's word
  std::string reason;       ///< of the decision
};

/// Two sessions with inter-session loops, as `merge::PairOutcome` has them.
struct PairResult {
  std::int64_t match = 0;       ///< row of a session
  std::int64_t query = 0;       ///< row of the other
  std::string state;            ///< the word of `merge::state_name`
  std::string reason;           ///< why it is not confirmed, empty otherwise
  std::uint64_t loops = 0;      ///< verified by registration
  std::uint64_t distinct = 0;   ///< of the largest consistent set
  std::uint64_t competing = 0;  ///< of the largest set that contradicts it
  Pose T_match_query;           ///< between odometry frames, by the consistent set
};

/// What a merge made of a known position, as `merge::PositionOutcome` has it.
struct PositionResult {
  KeyframeRow keyframe;                                ///< the keyframe it belongs to
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< site frame, metres
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< levelled keyframe frame, metres
  std::optional<double> sigma_xy_m;                    ///< none: x and y are not known
  double sigma_z_m = 0.0;                              ///< of z
  bool used = false;                                   ///< part of the pose graph
  std::string reason;                                  ///< why not, empty otherwise
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();  ///< the map's less the given one
};

/// Where a map lies in the site frame, as `merge::Georeference` has it.
struct GeoreferenceResult {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the map frame, metres
  bool is_horizontal = false;                        ///< not the height alone
  std::optional<double> heading_sigma_rad;           ///< none: not known
};

/// What a merge found; the map itself follows from it.
struct MapResult {
  std::string parameters;                            ///< of the merger, as JSON
  std::vector<SessionResult> sessions;               ///< in the order of the merge
  std::vector<LoopResult> loops;                     ///< in the order of the merge
  std::vector<PairResult> pairs;                     ///< in the order of the merge
  std::vector<PositionResult> positions{};           ///< in the order of the merge
  std::optional<GeoreferenceResult> georeference{};  ///< of the map frame, if positions place it
};

}  // namespace unimapper::store
