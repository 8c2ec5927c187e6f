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
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper::datasets;

/// The same bytes as every table: JSON of any form must be read or refused.
void parse_nuscenes(std::string_view bytes) {
  const NuScenesTable table = [&](std::string_view) { return std::string(bytes); };
  for (const std::string& scene : parse_nuscenes_scenes(table, "tables")) {
    (void)parse_nuscenes_sweeps(table, scene, "tables");
  }
}

using Parser = void (*)(std::string_view bytes, Scan& scan);
constexpr Parser kParsers[] = {
    [](std::string_view bytes, Scan& scan) { (void)parse_pcd(bytes, "file", scan); },
    [](std::string_view bytes, Scan& scan) { (void)parse_pcd(bytes, "file", scan); },
    [](std::string_view bytes, Scan&) { (void)parse_pcd_header(bytes, "file"); },
    [](std::string_view bytes, Scan&) { (void)parse_trajectory(bytes, "file"); },
    [](std::string_view bytes, Scan&) {
      (void)parse_trajectory(bytes, "file", StampUnit::kNanoseconds);
    },
    [](std::string_view bytes, Scan&) { (void)parse_times(bytes, "file"); },
    [](std::string_view bytes, Scan&) { (void)parse_calibration(bytes, "file"); },
    [](std::string_view bytes, Scan& scan) {
      parse_helipr(bytes, HeliprSensor::kAeva, 0, "file", scan);
    },
    [](std::string_view bytes, Scan& scan) { parse_ply(bytes, "file", scan); },
    [](std::string_view bytes, Scan& scan) { parse_xyz(bytes, "file", scan); },
    [](std::string_view bytes, Scan&) { (void)parse_oxts(bytes, "file"); },
    [](std::string_view bytes, Scan&) { (void)parse_raw_calibration(bytes, "file"); },
    [](std::string_view bytes, Scan&) { (void)parse_point_fields(bytes); },
    [](std::string_view bytes, Scan&) { parse_nuscenes(bytes); },
    [](std::string_view bytes, Scan& scan) {
      parse_helipr(bytes, HeliprSensor::kAvia, 0, "file", scan);
    }};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Scan scan;
  unimapper::fuzz::allow_refusal<DatasetError>([&] {
    kParsers[data[0] % std::size(kParsers)](unimapper::fuzz::text_of(data + 1, size - 1), scan);
  });
  return 0;
}
