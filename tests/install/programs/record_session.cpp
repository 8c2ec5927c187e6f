// A robot programmed in C++: scans in, the bytes of keyframes out, one file each.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "street.h"
#include "unimapper/onboard/pipeline.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

using namespace unimapper;

namespace {

struct alignas(64) CacheLine {
  std::byte bytes[64];
};

std::vector<CacheLine> memory_of(std::size_t bytes) {
  return std::vector<CacheLine>(bytes / sizeof(CacheLine) + 1);
}

std::span<std::byte> bytes_of(std::vector<CacheLine>& memory) {
  return std::as_writable_bytes(std::span(memory));
}

/// Whether the keyframe's bytes are in a file now.
bool write_keyframe(const KeyframeView& keyframe, wire::KeyframeEncoder& encoder,
                    const std::filesystem::path& directory) {
  static std::vector<std::uint8_t> buffer(std::size_t{4} << 20U);
  const wire::EncodeResult result = encoder.encode(keyframe, {2, 22}, buffer);
  if (result.error.code != ErrorCode::kOk) return std::puts(result.error.message), false;
  const std::string name = std::to_string(1000000 + keyframe.sequence).substr(1) + ".keyframe";
  std::ofstream file(directory / name, std::ios::binary);
  file.write(reinterpret_cast<const char*>(buffer.data()),
             static_cast<std::streamsize>(result.bytes));
  return static_cast<bool>(file.flush());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::puts("usage: record_session_cpp DIRECTORY"), 2;
  const PipelineConfig config = preset(SensorKind::kVlp16, Computer::kJetson);
  std::vector<CacheLine> memory = memory_of(Pipeline::required_bytes(config));
  auto pipeline = Pipeline::create(config, bytes_of(memory));
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  const std::uint32_t cells = config.voxel.max_cells;
  std::vector<CacheLine> scratch = memory_of(wire::KeyframeEncoder::required_bytes(cells));
  auto encoder = wire::KeyframeEncoder::create(cells, bytes_of(scratch));
  if (!encoder) return std::puts(encoder.error().message), 1;

  static Street street;
  street_build(&street);
  const Pose T_odometry_world(
      Eigen::Quaterniond(Eigen::AngleAxisd(kSecondYaw, Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(kSecondTranslation));
  unsigned keyframes = 0;
  for (int scan = 0; scan < kScans; ++scan) {
    Eigen::Vector3d position;
    street_scan(&street, scan, kSecondOffset);
    street_sensor(scan, kSecondOffset, position.data());
    const Pose T_world_sensor(Eigen::Quaterniond::Identity(), position);
    const ScanResult result = pipeline.value()->add_scan(
        PointView::xyz(street.points[0], kPoints, sizeof street.points[0]),
        T_odometry_world * T_world_sensor, std::int64_t{100000000} * scan);
    if (result.error.code != ErrorCode::kOk) return std::puts(result.error.message), 1;
    if (!result.keyframe_ready) continue;
    if (!write_keyframe(pipeline.value()->keyframe(), *encoder, argv[1])) return 1;
    ++keyframes;
  }
  std::printf("%u keyframes written\n", keyframes);
  return keyframes > 0 ? 0 : 1;
}
