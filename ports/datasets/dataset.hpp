// Interface of recorded sequences, independent of their format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets {

/// A file could not be understood. The message names the file, the offset or line, and why.
class DatasetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One topic holds the scans of several LiDARs, and none of them was chosen.
class SeveralLidarsError : public DatasetError {
 public:
  SeveralLidarsError(const std::string& message, std::vector<std::string> topics)
      : DatasetError(message), topics_(std::move(topics)) {}
  /// What chooses each of them as `OpenOptions::topic`, e.g. "/points\@front".
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }

 private:
  std::vector<std::string> topics_;
};

/// One scan in the sensor frame.
struct Scan {
  /// One point as the files hold it: metres in the sensor frame, intensity as recorded.
  struct Point {
    float x;          ///< along the first axis
    float y;          ///< along the second axis
    float z;          ///< along the third axis
    float intensity;  ///< as the file has it
  };
  std::vector<Point> points;  ///< in the order of the file
  /// Of each point, when it was measured: seconds after the scan's stamp, may be negative. Empty
  /// where the file does not say.
  std::vector<float> time_s;
  /// Of each point, the number of the laser or row it was measured with. Empty where the file does
  /// not say.
  std::vector<std::uint16_t> ring;

  /// Of the numbers that `time_s` was read from; 0 where the file does not say.
  double seconds_per_time_unit = 0.0;
  /// Points whose time is of no sweep that the others are of: `time_s` is that of the point before.
  std::size_t points_without_time = 0;

  /// Of the places of the points as recorded: scans that repeat each other have the same, whatever
  /// is done to their points behind the reader. 0: without points, or not known.
  std::uint64_t fingerprint = 0;

  /// What readers of points in doubles subtract before these become floats, metres: points of a
  /// map far from its origin.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  /// Makes room for `count` points of unknown time and ring.
  void reset(std::size_t count) {
    points.resize(count);
    time_s.clear();
    ring.clear();
    seconds_per_time_unit = 0.0;
    points_without_time = 0;
    fingerprint = 0;
  }
  /// Adds the time of the next point, which counts from `zero`.
  void add_time(double time, double zero, double seconds_per_unit, bool is_of_sweep) {
    seconds_per_time_unit = seconds_per_unit;
    const float before_s = time_s.empty() ? 0.0F : time_s.back();
    time_s.push_back(is_of_sweep ? static_cast<float>((time - zero) * seconds_per_unit) : before_s);
    points_without_time += is_of_sweep ? 0 : 1;
  }
  /// The points where they lie, valid as long as `points` does not change.
  [[nodiscard]] PointView view() const {
    return PointView::xyz(points.data(), points.size(), sizeof(Point));
  }
};

/// What a reader tells the user about its input, in one line without a final stop.
struct Note {
  std::string text;         ///< e.g. "poses matched by stamp, the farthest 12 ms away"
  bool is_warning = false;  ///< worth a warning: the input may be wrong
  /// The likely reason where poses and scans contradict each other.
  bool is_about_mounting = false;
};

/// Where a receiver of satellites found its antenna.
struct Fix {
  std::int64_t stamp_ns = 0;             ///< by the clock of the scans
  double latitude_deg = 0.0;             ///< WGS84
  double longitude_deg = 0.0;            ///< WGS84
  double height_m = 0.0;                 ///< above the ellipsoid
  double sigma_xy_m = 0.0;               ///< standard deviation of east and of north
  double sigma_z_m = 0.0;                ///< standard deviation of the height
  std::optional<Eigen::Vector3d> lever;  ///< the antenna in the sensor's frame; empty: not known
};

/// What the gyroscope and the accelerometer of an IMU measured.
struct RecordedGyroscope {
  /// By the axes of the scans and the clock of their stamps.
  struct Sample {
    std::int64_t stamp_ns;  ///< when it was measured
    Eigen::Vector3d rad_s;  ///< may be wrong in any way but finite
    /// In m/s² or g, at rest along up; zero where there is none. Finite.
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  };
  std::vector<Sample> samples;  ///< in the order of their stamps; empty: there is none
  std::string description;      ///< e.g. "/imu (sensor_msgs/Imu, 900 messages)"
  std::vector<Note> notes;      ///< what was left out or not used
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
  /// What that pose is uncertain by since the scan before (`Pipeline::add_slip`), m².
  [[nodiscard]] virtual Eigen::Matrix3d slip(std::size_t /*i*/) const {
    return Eigen::Matrix3d::Zero();
  }
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
  /// What was chosen or may be wrong about the input.
  [[nodiscard]] virtual std::vector<Note> notes() const { return {}; }
  /// Whether the recording says where its LiDARs are mounted, so that --extrinsic replaces it.
  [[nodiscard]] virtual bool is_mounted_by_recording() const { return false; }
  /// Whether poses were recorded; else each is the identity.
  [[nodiscard]] virtual bool has_poses() const { return true; }
  /// T_odometry_sensor at any time, where the recording has an odometry of a rate of its own; empty
  /// without one, and beyond its ends.
  [[nodiscard]] virtual std::optional<Pose> pose_at(std::int64_t /*stamp_ns*/) const {
    return std::nullopt;
  }
  /// Positions by satellites, in the order of recording.
  [[nodiscard]] virtual std::vector<Fix> fixes() const { return {}; }
  /// The gyroscope whose axes are known in the scans' frame. Reads all of it. Throws DatasetError.
  [[nodiscard]] virtual RecordedGyroscope gyroscope() const { return {}; }
  /// How far the poses' z axis may be from up, standard deviation; 0: nothing tells.
  [[nodiscard]] virtual double up_sigma_deg() const { return 0.0; }
};

/// Whether points are moved from the sensor's frames of their own times to that of their scan.
enum class Deskew : std::uint8_t {
  kAuto,  ///< where that makes scans sharper
  kOn,    ///< wherever points have a time
  kOff,
};

/// How a recording is opened. Every member may stay as it is.
struct OpenOptions {
  std::string format = "auto";    ///< name of a reader (readers.hpp); "auto": as it looks
  std::string sensor{};           ///< the LiDAR, where a recording holds several
  std::string sequence{};         ///< of a folder of several sequences, e.g. "00"
  std::filesystem::path poses{};  ///< pose file; empty: where the layout has it
  /// Poses of the own odometry (own_odometry.hpp), also where others were recorded.
  bool own_odometry = false;
  std::size_t most_scans = 0;  ///< that the own odometry reads; 0: all
  /// Told of the own odometry after each scan how many are done, and how many there are.
  std::function<void(std::size_t done, std::size_t all)> odometry_progress{};
  std::string point_fields{};  ///< of records without a header, e.g. "x y z intensity ring"
  /// Of the scans, in a bag; behind an at sign the frame of one LiDAR, where several are on it.
  std::string topic{};
  std::string odometry_topic{};  ///< of the poses, in a bag
  /// Of the gyroscope for the own odometry, in a bag; empty: the LiDAR's; "off": none.
  std::string imu_topic{};
  std::string frame{};  ///< in which a bag's transforms give poses, e.g. "odom"
  /// Where each LiDAR is on what the poses are of, in the order of `topic`; empty: as the recording
  /// says, or at its origin.
  std::vector<Pose> T_base_lidar{};
  /// Mount that calibration found besides, T_given_lidar; of one LiDAR.
  Pose T_given_lidar{};
  bool finds_mount = false;               ///< the caller is to find it (--extrinsic auto)
  double time_offset_s = 0.0;             ///< added to the poses' stamps
  bool finds_time_offset = false;         ///< the caller is to find it (--time-offset auto)
  bool turns_over = false;                ///< the poses stand on their head, see `turned_over`
  bool refuses_unknown_mounting = false;  ///< of a bag without the transform to the LiDAR
  Deskew deskew = Deskew::kAuto;          ///< see deskew.hpp
};

/// Opens the folder or file at `path` with the reader that the options name, or the first that
/// recognises it. Scans without recorded poses get those of the own odometry. Several topics with
/// commas between them are several LiDARs of one robot (mounting.hpp); where one of them is mounted
/// must be known. So are several LiDARs on one topic. Throws DatasetError.
std::unique_ptr<Dataset> open_dataset(const std::filesystem::path& path,
                                      const OpenOptions& options = {});

}  // namespace unimapper::datasets
