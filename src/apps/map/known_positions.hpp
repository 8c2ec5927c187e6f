// Known positions of keyframes, from what people give to what a merge takes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "ports/store/project.hpp"
#include "src/apps/map/position_file.hpp"
#include "src/apps/map/stored_result.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::apps {

/// Positions of rows for the keyframes of a session, ascending, and how many rows are not among
/// them: of several rows with stamps the one nearest to a keyframe's reference scan is taken.
struct AssignedPositions {
  std::vector<store::StoredPosition> positions;
  /// Rows that lie beside another one, in a gap of the session, or before or after it.
  std::size_t left_out = 0;
  std::string lasts;  ///< from when to when the session lasts, for messages
};

/// Assigns rows to keyframes; `lever` is the point in the sensor's frame of rows without one. The
/// way between a stamp and the reference scan is the odometry's. Throws std::runtime_error with
/// file and line for a keyframe that is not there.
AssignedPositions assign_positions(const SessionData& session, const std::vector<PositionRow>& rows,
                                   const Eigen::Vector3d& lever, const std::string& file);

/// A position of a session's keyframe as a merge takes it.
merge::KnownPosition known_position(KeyframeId id, const KeyframeRecord& keyframe,
                                    const store::StoredPosition& position);

/// The positions of the statements in effect whose keyframes are merged, in the order of the
/// statements. Of a keyframe with several the latest one that was said of it alone, else the
/// latest.
std::vector<merge::KnownPosition> positions_of(const store::ProjectState& state,
                                               const KeyframeRows& rows);

/// What a merge made of positions as the store has it, and back.
void keep_positions(const merge::MergeResult& result, const KeyframeRows& rows,
                    store::MapResult& stored);
void restore_positions(const store::MapResult& stored, const KeyframeRows& rows,
                       merge::MergeResult& posed);

}  // namespace unimapper::apps
