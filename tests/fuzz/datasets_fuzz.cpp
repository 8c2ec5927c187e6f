// Fuzz target of the parsers of recordings.
//
// The first byte chooses the parser, so that a corpus entry belongs to one of them.
#include <cstdint>
#include <string>
#include <string_view>

#include "ports/datasets/helipr.hpp"
#include "ports/datasets/kitti_raw.hpp"
#include "ports/datasets/nuscenes.hpp"
#include "ports/datasets/pcd.hpp"
#include "ports/datasets/ply.hpp"
#include "ports/datasets/point_fields.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/xyz.hpp"

namespace {

using namespace unimapper::datasets;

/// The same bytes as every table: JSON of any form must be read or refused.
void parse_nuscenes(std::string_view bytes) {
  const NuScenesTable table = [&](std::string_view) { return std::string(bytes); };
  for (const std::string& scene : parse_nuscenes_scenes(table, "tables")) {
    (void)parse_nuscenes_sweeps(table, scene, "tables");
  }
}

void parse(std::uint8_t choice, std::string_view bytes) {
  Scan scan;
  switch (choice % 15) {
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
    case 8:
      parse_ply(bytes, "file", scan);
      break;
    case 9:
      parse_xyz(bytes, "file", scan);
      break;
    case 10:
      (void)parse_oxts(bytes, "file");
      break;
    case 11:
      (void)parse_raw_calibration(bytes, "file");
      break;
    case 12:
      (void)parse_point_fields(bytes);
      break;
    case 13:
      parse_nuscenes(bytes);
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
