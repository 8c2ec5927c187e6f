// Loop between two keyframes, as robots and the base report it.
#pragma once

#include <cstdint>
#include <string>

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// One row of loops.csv: it names sessions, and keyframes by `KeyframeRecord::sequence`, so that it
/// is understood outside the program that wrote it.
struct LoopRecord {
  std::string query_session;         ///< name of the session that was searched for
  std::uint32_t query_keyframe = 0;  ///< its keyframe's `sequence`
  std::uint32_t query_scan = 0;      ///< `KeyframeScan::scan_index` of the reference scan
  std::string match_session;         ///< name of the session that was found
  std::uint32_t match_keyframe = 0;  ///< its keyframe's `sequence`
  std::uint32_t match_scan = 0;      ///< `KeyframeScan::scan_index` of the match's reference scan
  double confidence = 0.0;           ///< as in `LoopCandidate`, [0, 1]
  bool accepted = false;             ///< whether the loop is accepted
  std::string reason;                ///< how an accepted loop was found, or why it was refused
  Pose T_match_query;                ///< between the sensor frames of the two reference scans
};

}  // namespace unimapper
