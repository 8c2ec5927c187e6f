// Files of an exported map.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "unimapper/merge/export.hpp"

namespace unimapper::merge {

/// A file opened for writing. `close()` says whether everything arrived.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& path)
      : path_(path), stream_(path, std::ios::binary | std::ios::trunc) {
    if (!stream_) throw std::runtime_error(path_.string() + ": cannot be created");
  }
  std::ofstream& stream() { return stream_; }
  void close() {
    stream_.close();
    if (!stream_) throw std::runtime_error(path_.string() + ": cannot be written (disk full?)");
  }

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

/// The one of the two quaternions of a rotation with w >= 0.
inline Eigen::Quaterniond canonical_quaternion(const Pose& pose) {
  Eigen::Quaterniond q = pose.quaternion();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

void write_trajectory(const std::filesystem::path& path, const SessionData& session,
                      const MergedSession& merged);
void write_pose_graph(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                      const MergeResult& result);
void write_loops(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                 const MergeResult& result);
void write_map_points(const std::filesystem::path& path, const MergeResult& result);
void write_changed_points(const std::filesystem::path& path, const MergeResult& result);
void write_summary(const std::filesystem::path& path, const std::vector<SessionData>& sessions,
                   const MergeResult& result);
void write_timing(const std::filesystem::path& path, const MergeResult& result);

}  // namespace unimapper::merge
