// LCM: keyframes sent as datagrams while the robot drives.
#include <cstdio>
#include <exception>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <unimapper/wire/keyframe_encoder.hpp>

#include "ports/lcm/live.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/linux/boot_id.hpp"

using namespace unimapper;

int main(int argc, char** argv) try {
  const PipelineConfig config = preset(SensorKind::kVlp16, Computer::kJetson);
  OwnedPipeline pipeline(config);
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  alignas(64) static std::byte scratch[1 << 23];  // 16 bytes a cell; encoding allocates nothing
  auto encoder = wire::KeyframeEncoder::create(config.voxel.max_cells, scratch);
  if (!encoder) return std::puts(encoder.error().message), 1;
  const SessionId session{7, linux_port::random_boot()};  // this robot, this start of it
  const char* url = argc > 1 ? argv[1] : "udpm://239.255.76.67:7667?ttl=0";
  lcm_port::Publisher publisher({session, "robot7", "vlp-16"}, lcm_port::open_link(url));

  float scan[1000][3] = {};
  for (int i = 0; i < 1000; ++i) scan[i][0] = 10, scan[i][1] = 0.1F * i - 50;
  std::vector<std::uint8_t> bytes(1 << 20);
  for (std::int64_t k = 1; k <= 20; ++k) {
    const PointView points = PointView::xyz(scan, 1000, 12);
    if (!pipeline->add_scan(points, Pose{}, k * 100'000'000).keyframe_finished) continue;
    const KeyframeView& keyframe = pipeline->finished_keyframe();
    const wire::EncodeResult encoded = encoder->encode(keyframe, session, bytes);
    if (!encoded.error.ok()) return std::puts(encoded.error.message), 1;
    publisher.publish({session, keyframe.sequence, keyframe.scans.back().stamp_ns,
                       std::vector(bytes.data(), bytes.data() + encoded.bytes)});
  }
  std::printf("%lu keyframes sent\n",
              static_cast<unsigned long>(publisher.finish().keyframes_sent));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
