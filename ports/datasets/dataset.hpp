// Interface of recorded sequences, independent of their format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets {

/// A file could not be understood. The message names the file, the offset or line, and why.
class DatasetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One scan in the sensor frame, float32 x y z intensity.
struct Scan {
  /// One point as the files hold it: metres in the sensor frame, intensity as recorded.
  struct Point {
    float x;          ///< along the first axis
    float y;          ///< along the second axis
    float z;          ///< along the third axis
    float intensity;  ///< as the file has it
  };
  std::vector<Point> points;  ///< in the order of the file
  /// The points where they lie, valid as long as `points` does not change.
  [[nodiscard]] PointView view() const {
    return PointView::xyz(points.data(), points.size(), sizeof(Point));
  }
};

/// A sequence of scans with one pose and one stamp each. Reads lazily, one scan at a time.
class Dataset {
 public:
  virtual ~Dataset() = default;
  /// Number of scans.
  [[nodiscard]] virtual std::size_t scan_count() const = 0;
  /// Reads scan `i` into `scan` (reusing its memory). Throws DatasetError.
  virtual void read_scan(std::size_t i, Scan& scan) const = 0;
  /// T_odometry_sensor of scan `i`.
  [[nodiscard]] virtual const Pose& pose(std::size_t i) const = 0;
  /// Stamp of scan `i`, nanoseconds.
  [[nodiscard]] virtual std::int64_t stamp_ns(std::size_t i) const = 0;
  /// File-name stem of scan `i`, e.g. "000042"; labels are written under it.
  [[nodiscard]] virtual std::string scan_name(std::size_t i) const = 0;
  /// Ground-truth semantic labels of scan `i` (lower 16 bits SemanticKITTI id), empty if none.
  [[nodiscard]] virtual std::vector<std::uint32_t> labels(std::size_t i) const = 0;
  /// T_world_sensor ground truth of every scan; empty if the sequence has none.
  [[nodiscard]] virtual std::vector<Pose> ground_truth_poses() const = 0;
  /// Canonical name of the LiDAR (see `find_sensor`) where the format implies one, else empty.
  [[nodiscard]] virtual std::string sensor() const { return {}; }
};

enum class Format { kAuto, kKitti, kPcd, kDynamicMap, kHelipr };

/// Parses "auto", "kitti", "pcd", "dynamicmap" or "helipr".
std::optional<Format> parse_format(std::string_view name);

/// Opens `path`, recognising its format when `kAuto`. `sensor` chooses the LiDAR where a
/// sequence holds several (HeLiPR) and may be empty otherwise. Throws DatasetError.
std::unique_ptr<Dataset> open_dataset(const std::filesystem::path& path,
                                      Format format = Format::kAuto,
                                      const std::string& sensor = {});

}  // namespace unimapper::datasets
