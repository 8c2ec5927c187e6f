#include "src/apps/evaluate/labelled_run.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace unimapper::apps {

LabelledRun::LabelledRun(std::unique_ptr<datasets::Dataset> truth, const std::filesystem::path& run,
                         std::size_t scans)
    : dataset_(std::move(truth)),
      labels_(run / "labels"),
      scans_(std::min(scans, dataset_->scan_count())) {
  if (!std::filesystem::is_directory(labels_)) {
    throw std::runtime_error(labels_.string() +
                             ": no such folder; `unimapper onboard` writes one label file per "
                             "scan there");
  }
}

std::size_t LabelledRun::scan_count() const { return scans_; }

evaluate::ScoredScan LabelledRun::scan(std::size_t i) {
  dataset_->read_scan(i, scan_);
  points_.clear();
  points_.reserve(scan_.points.size());
  for (const auto& p : scan_.points) points_.emplace_back(p.x, p.y, p.z);
  truth_ = dataset_->labels(i);
  has_truth_ = has_truth_ || !truth_.empty();
  truth_.resize(points_.size(), 0);
  read_predictions(dataset_->scan_name(i), points_.size());
  return {points_, dataset_->pose(i), truth_, predicted_};
}

void LabelledRun::read_predictions(const std::string& name, std::size_t points) {
  const std::filesystem::path file = labels_ / (name + ".label");
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error) {
    throw std::runtime_error(file.string() +
                             ": no such file; the run must label every scan of the dataset");
  }
  if (bytes != points * sizeof(std::uint32_t)) {
    throw std::runtime_error(file.string() + ": " + std::to_string(bytes) +
                             " bytes, but the scan has " + std::to_string(points) +
                             " points of 4 bytes each; run and dataset do not belong together, "
                             "or the file is truncated");
  }
  predicted_.resize(points);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(predicted_.data()), static_cast<std::streamsize>(bytes));
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
}

}  // namespace unimapper::apps
