// Base of datasets that change another one.
#pragma once

#include <memory>
#include <utility>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Passes on what the other dataset has; classes derived from it change a part.
class DatasetDecorator : public Dataset {
 public:
  [[nodiscard]] std::size_t scan_count() const override { return inner_->scan_count(); }
  void read_scan(std::size_t i, Scan& scan) const override { inner_->read_scan(i, scan); }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return inner_->pose(i); }
  [[nodiscard]] Eigen::Matrix3d slip(std::size_t i) const override { return inner_->slip(i); }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override { return inner_->stamp_ns(i); }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return inner_->scan_name(i); }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t i) const override {
    return inner_->labels(i);
  }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override {
    return inner_->ground_truth_poses();
  }
  [[nodiscard]] std::string sensor() const override { return inner_->sensor(); }
  [[nodiscard]] std::vector<Note> notes() const override { return inner_->notes(); }
  [[nodiscard]] bool is_mounted_by_recording() const override {
    return inner_->is_mounted_by_recording();
  }
  [[nodiscard]] bool has_poses() const override { return inner_->has_poses(); }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    return inner_->pose_at(stamp_ns);
  }
  [[nodiscard]] std::vector<Fix> fixes() const override { return inner_->fixes(); }
  [[nodiscard]] RecordedGyroscope gyroscope() const override { return inner_->gyroscope(); }
  [[nodiscard]] double up_sigma_deg() const override { return inner_->up_sigma_deg(); }

 protected:
  explicit DatasetDecorator(std::shared_ptr<Dataset> inner) : inner_(std::move(inner)) {}
  /// The dataset that is decorated.
  [[nodiscard]] const Dataset& inner() const { return *inner_; }

 private:
  std::shared_ptr<Dataset> inner_;
};

}  // namespace unimapper::datasets
