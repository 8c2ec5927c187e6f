// Tests of intensities as bytes.
#include "ports/datasets/intensity.hpp"

#include <cmath>
#include <utility>

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::datasets;

namespace {

/// Scans of such intensities.
class Recording : public Dataset {
 public:
  explicit Recording(std::vector<std::vector<float>> scans) : scans_(std::move(scans)) {}
  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }
  void read_scan(std::size_t i, Scan& scan) const override {
    scan.reset(0);
    for (const float intensity : scans_[i]) scan.points.push_back({1, 2, 3, intensity});
  }
  [[nodiscard]] const Pose& pose(std::size_t /*i*/) const override { return pose_; }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t /*i*/) const override { return 0; }
  [[nodiscard]] std::string scan_name(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }

 private:
  std::vector<std::vector<float>> scans_;
  Pose pose_;
};

IntensityScale scale_of(std::vector<std::vector<float>> scans) {
  return IntensityScale(Recording(std::move(scans)));
}

Scan scan_of(const std::vector<float>& intensities) {
  Scan scan;
  for (const float intensity : intensities) scan.points.push_back({1, 2, 3, intensity});
  return scan;
}

std::vector<int> bytes(IntensityScale scale, const std::vector<float>& intensities) {
  const auto found = scale.bytes(scan_of(intensities));
  return {found.begin(), found.end()};
}

}  // namespace

TEST_CASE("The range of intensities is that of the recording's scans") {
  const IntensityScale shares = scale_of({{0.0F, 0.5F, 1.0F}});
  CHECK(bytes(shares, {0.0F, 0.5F, 1.0F}) == std::vector{1, 128, 255});
  CHECK(bytes(shares, {0.1F, 200.0F, NAN, -1.0F}) == std::vector{26, 255, 1, 1});
  CHECK(bytes(scale_of({{255.0F}}), {0.2F, 17.0F, 255.0F}) == std::vector{1, 17, 255});
  CHECK(bytes(scale_of({{3000.0F}}), {0.0F, 2048.0F, 3000.0F}) == std::vector{1, 128, 187});
  CHECK(bytes(scale_of({{65535.0F}}), {0.0F, 6553.5F, 65535.0F}) == std::vector{1, 26, 255});
}

TEST_CASE("A dark scan at the begin of a recording does not set the range of intensities") {
  std::vector<std::vector<float>> scans(40, {10.0F, 200.0F});
  scans.front() = {0.4F, 0.9F};
  CHECK(scale_of(scans).range() == 255.0F);
}

TEST_CASE("One retroreflector in a hundred does not set the range") {
  std::vector<float> intensities(200, 100.0F);
  intensities.back() = 60000.0F;
  CHECK(bytes(scale_of({intensities}), intensities).front() == 100);
}

TEST_CASE("Scans without intensities have no bytes, nor set the range") {
  CHECK(scale_of({{}, {0.0F, 0.0F, NAN}}).range() == 0.0F);
  CHECK(bytes(scale_of({}), {200.0F}).empty());
  CHECK(bytes(scale_of({{}, {200.0F}}), {200.0F}) == std::vector{200});
}
