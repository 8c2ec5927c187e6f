// Point clouds as LAS files.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// What the coordinates of a LAS file are given in.
struct LasFrame {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< added to the points, metres
  std::string wkt;            ///< of the coordinate system (OGC 01-009); empty: not known
  std::int64_t stamp_ns = 0;  ///< whose day is the file's date: equal maps are equal files
};

/// Stamp of the last scan of all keyframes; 0 without any.
[[nodiscard]] std::int64_t last_stamp_ns(std::span<const SessionData> sessions);

/// The offset of a map's files: of its points in the site frame, or in the odometry's.
[[nodiscard]] Eigen::Vector3d map_offset(const std::vector<SessionData>& sessions,
                                         const MergeResult& result);

/// LAS 1.4 with point format 6, coordinates in millimetres: class 2 for ground, else 1; the point
/// source is the session's index plus 1, the user data how many sessions saw it (255: or more), the
/// intensity 257 times that of the point.
/// O(points); one block is in memory. Throws std::runtime_error for a full disk, for points that
/// are not finite or farther than 2147 km from the offset, and for more than 65535 sessions.
void write_las(const std::filesystem::path& path, const ExternalVector<MapPoint>& points,
               const LasFrame& frame);

}  // namespace unimapper::merge
