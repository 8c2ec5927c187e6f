#include "drive.hpp"

namespace unimapper::bench {

Drive::Drive(const datasets::Dataset& dataset) : scans_(dataset.scan_count()) {
  if (scans_.size() < 2) throw datasets::DatasetError("a drive needs two scans");
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    dataset.read_scan(i, scans_[i]);
    poses_.push_back(dataset.pose(i));
    stamps_ns_.push_back(dataset.stamp_ns(i));
  }
}

std::size_t Drive::scan_of(std::size_t step) const {
  const std::size_t within = step % period();
  return within < scans_.size() ? within : period() - within;
}

TimedScan Drive::operator[](std::size_t step) const {
  const std::size_t scan = scan_of(step);
  const std::int64_t there_ns = stamps_ns_.back() - stamps_ns_.front();
  const auto turns = static_cast<std::int64_t>(step / (scans_.size() - 1));
  const std::int64_t since_turn_ns =
      turns % 2 == 0 ? stamps_ns_[scan] - stamps_ns_.front() : stamps_ns_.back() - stamps_ns_[scan];
  return {scans_[scan].view(), poses_[scan], stamps_ns_.front() + turns * there_ns + since_turn_ns};
}

}  // namespace unimapper::bench
