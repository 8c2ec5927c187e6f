// Fuzz target of the parsers of recordings.
//
// The first byte chooses the parser, so that a corpus entry belongs to one of them.
#include <cstdint>
#include <string_view>

#include "ports/datasets/helipr.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/poses.hpp"

namespace {

using namespace unimapper::datasets;

void parse(std::uint8_t choice, std::string_view bytes) {
  Scan scan;
  switch (choice % 9) {
    case 0:
    case 1:
      (void)parse_pcd(bytes, "file", scan);
      break;
    case 2:
      (void)parse_pcd_header(bytes, "file");
      break;
    case 3:
      (void)parse_trajectory(bytes, "file");
      break;
    case 4:
      (void)parse_trajectory(bytes, "file", StampUnit::kNanoseconds);
      break;
    case 5:
      (void)parse_times(bytes, "file");
      break;
    case 6:
      (void)parse_calibration(bytes, "file");
      break;
    case 7:
      parse_helipr(bytes, HeliprSensor::kAeva, 0, "file", scan);
      break;
    default:
      parse_helipr(bytes, HeliprSensor::kAvia, 0, "file", scan);
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    parse(data[0], {reinterpret_cast<const char*>(data) + 1, size - 1});
  } catch (const DatasetError&) {
    // The one way to refuse; anything else ends the fuzzer.
  }
  return 0;
}
