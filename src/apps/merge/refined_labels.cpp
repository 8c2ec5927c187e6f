// Refined labels of a recording's scans.
#include "src/apps/merge/refined_labels.hpp"

#include <map>
#include <stdexcept>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/label_values.hpp"
#include "ports/datasets/writers.hpp"
#include "src/apps/merge/cell_labels.hpp"

namespace unimapper::apps {
namespace {

namespace fs = std::filesystem;

/// Labels of one recording, scan by scan.
class LabelWriter {
 public:
  LabelWriter(const fs::path& folder, const datasets::Dataset& dataset)
      : labels_(folder / "labels"), dataset_(dataset), written_(dataset.scan_count(), false) {
    for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
      index_at_.emplace(dataset.stamp_ns(i), i);
    }
    datasets::make_directory(labels_);
  }

  void write(const KeyframeRecord& keyframe, const merge::RefinedKeyframe& refined) {
    const CellLabels cells(keyframe, refined);
    for (const KeyframeScan& scan : keyframe.scans) {
      // By stamp: a run that was cut counts its scans anew, and scans without poses are left out.
      const auto found = index_at_.find(scan.stamp_ns);
      if (found == index_at_.end()) {
        throw std::runtime_error("--truth: the recording has no scan " +
                                 std::to_string(scan.scan_index) +
                                 "; the session was made of another one");
      }
      const Pose T_keyframe_sensor =
          keyframe.T_odometry_keyframe.inverse() * scan.T_odometry_sensor;
      write_scan(found->second, T_keyframe_sensor, cells);
    }
  }

  /// Labels of the scans that are in no whole keyframe: all static. Returns how many there are.
  std::size_t write_remaining() {
    std::size_t count = 0;
    for (std::size_t i = 0; i < written_.size(); ++i) {
      if (written_[i]) continue;
      ++count;
      dataset_.read_scan(i, scan_);
      labels_of_scan_.assign(scan_.points.size(), datasets::kLabelStatic);
      write_file(i);
    }
    return count;
  }

 private:
  void write_scan(std::size_t index, const Pose& T_keyframe_sensor, const CellLabels& cells) {
    dataset_.read_scan(index, scan_);
    labels_of_scan_.assign(scan_.points.size(), datasets::kLabelStatic);
    const Eigen::Matrix3f r = T_keyframe_sensor.rotation.cast<float>();
    const Eigen::Vector3f t = T_keyframe_sensor.translation.cast<float>();
    for (std::size_t i = 0; i < labels_of_scan_.size(); ++i) {
      const auto& p = scan_.points[i];
      const Eigen::Vector3f point = r * Eigen::Vector3f(p.x, p.y, p.z) + t;
      // Beyond any range, or not finite: never in a cell.
      if (!(point.cwiseAbs().maxCoeff() < 1e5F)) continue;
      if (cells.is_dynamic(point)) labels_of_scan_[i] = datasets::kLabelDynamic;
    }
    write_file(index);
    written_[index] = true;
  }

  void write_file(std::size_t index) const {
    datasets::write_labels(labels_ / (dataset_.scan_name(index) + ".label"), labels_of_scan_);
  }

  fs::path labels_;
  const datasets::Dataset& dataset_;
  std::map<std::int64_t, std::size_t> index_at_;  ///< of scans by their stamps, nanoseconds
  std::vector<bool> written_;
  datasets::Scan scan_;
  std::vector<std::uint32_t> labels_of_scan_;
};

}  // namespace

std::size_t write_refined_labels(const fs::path& folder, const fs::path& dataset,
                                 const SessionData& session, const merge::MergedSession& merged) {
  const auto recording = datasets::open_dataset(dataset, {.sensor = session.info.sensor});
  LabelWriter writer(folder, *recording);
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    if (session.keyframes[k].is_summary) continue;
    writer.write(*whole_keyframe(session, k), merged.refined[k]);
  }
  return writer.write_remaining();
}

}  // namespace unimapper::apps
