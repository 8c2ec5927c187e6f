// Scan source that pairs a run's labels with the ground truth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {

/// Reads scans, truth and the run's labels lazily; holds one scan at a time. Scans without
/// truth count as unlabelled. `scan` throws std::runtime_error when the run's labels are
/// missing or don't fit the scan.
class LabelledRun : public evaluate::ScanSource {
 public:
  /// Only the first `scans` of the recording count.
  LabelledRun(std::unique_ptr<datasets::Dataset> truth, const std::filesystem::path& run,
              std::size_t scans = SIZE_MAX);
  [[nodiscard]] std::size_t scan_count() const override;
  evaluate::ScoredScan scan(std::size_t i) override;

  /// The stem of the scan's files.
  [[nodiscard]] std::string scan_name(std::size_t i) const { return dataset_->scan_name(i); }

  /// True once a scan with truth was read.
  [[nodiscard]] bool has_truth() const { return has_truth_; }

 private:
  void read_predictions(const std::string& name, std::size_t points);

  std::unique_ptr<datasets::Dataset> dataset_;
  std::filesystem::path labels_;
  std::size_t scans_;
  datasets::Scan scan_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint32_t> truth_;
  std::vector<std::uint32_t> predicted_;
  bool has_truth_ = false;
};

}  // namespace unimapper::apps
