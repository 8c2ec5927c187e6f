// Tests of intensities as bytes.
#include "ports/datasets/intensity.hpp"

#include <cmath>

#include "tests/test.hpp"

using namespace unimapper::datasets;

namespace {

Scan scan_of(const std::vector<float>& intensities) {
  Scan scan;
  for (const float intensity : intensities) scan.points.push_back({1, 2, 3, intensity});
  return scan;
}

std::vector<int> bytes(IntensityScale& scale, const std::vector<float>& intensities) {
  const auto found = scale.bytes(scan_of(intensities));
  return {found.begin(), found.end()};
}

}  // namespace

TEST_CASE("The range of intensities is that of the recording's first scan") {
  IntensityScale shares;
  CHECK(bytes(shares, {0.0F, 0.5F, 1.0F}) == std::vector{1, 128, 255});
  CHECK(bytes(shares, {0.1F, 200.0F, NAN, -1.0F}) == std::vector{26, 255, 1, 1});
  IntensityScale of_8_bits;
  CHECK(bytes(of_8_bits, {0.2F, 17.0F, 255.0F}) == std::vector{1, 17, 255});
  IntensityScale of_12_bits;
  CHECK(bytes(of_12_bits, {0.0F, 2048.0F, 3000.0F}) == std::vector{1, 128, 187});
  IntensityScale of_16_bits;
  CHECK(bytes(of_16_bits, {0.0F, 6553.5F, 65535.0F}) == std::vector{1, 26, 255});
}

TEST_CASE("One retroreflector in a hundred does not set the range") {
  std::vector<float> intensities(200, 100.0F);
  intensities.back() = 60000.0F;
  IntensityScale scale;
  CHECK(bytes(scale, intensities).front() == 100);
}

TEST_CASE("A scan without intensities has no bytes, nor sets the range") {
  IntensityScale scale;
  CHECK(bytes(scale, {}).empty());
  CHECK(bytes(scale, {0.0F, 0.0F, NAN}).empty());
  CHECK(bytes(scale, {200.0F}) == std::vector{200});
}
