// Robot without a LiDAR: publishes seeded keyframes of a given size at a given rate.
//
// Prints "published SEQUENCE BYTES CRC32" of every keyframe, a hundred times a second "waiting
// SECONDS COUNT" of those that are not acknowledged, and at the end "acknowledged COUNT".
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <thread>

#include "ports/keys/guards.hpp"
#include "ports/keys/key_files.hpp"
#include "ports/keys/signature.hpp"
#include "ports/lcm/envelope.hpp"
#include "ports/lcm/live.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

struct Options {
  std::string url;
  std::string name;
  std::string key;
  std::uint32_t keyframes = 60;
  std::uint32_t bytes = 80000;
  std::uint64_t seed = 1;
  double period_ms = 100.0;
  bool waits = false;
  lcm_port::PublisherOptions publisher;
};

/// As of a live start: the robot's number is its key's or follows from its name, the session's is
/// drawn.
SessionId id_of(const std::string& name, const std::optional<keys::RobotKey>& key) {
  std::random_device device;
  const std::uint64_t high = device();
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(name.data());
  const std::uint32_t robot = key ? key->robot : wire::crc32({bytes, name.size()});
  return {robot, high << 32U | device()};
}

/// A keyframe of about `bytes` bytes: ten scans and cells scattered over a square and above it.
wire::EncodedKeyframe generate(const SessionId& session, std::uint32_t sequence,
                               std::uint32_t bytes, std::mt19937_64& random) {
  constexpr std::uint32_t kScans = 10;
  constexpr std::uint32_t kHeadBytes = 600;
  constexpr double kBytesPerCell = 1.08;
  constexpr double kCellsPerSquareMetre = 45.0;
  KeyframeRecord record;
  record.session = session;
  record.sequence = sequence;
  record.reference_scan = kScans / 2;
  record.scans.resize(kScans);
  for (std::uint32_t i = 0; i < kScans; ++i) {
    KeyframeScan& scan = record.scans[i];
    scan.scan_index = sequence * kScans + i;
    scan.stamp_ns = 1'600'000'000'000'000'000 + 100'000'000LL * scan.scan_index;
    scan.T_odometry_sensor.translation = {sequence + 0.1 * i, 0.0, 0.0};
  }
  record.T_odometry_keyframe = record.scans[record.reference_scan].T_odometry_sensor;
  const double content = bytes > kHeadBytes ? bytes - kHeadBytes : 0.0;
  const auto cells = static_cast<std::uint32_t>(content / kBytesPerCell);
  const auto reach_m = static_cast<float>(std::sqrt(cells / kCellsPerSquareMetre) / 2.0);
  std::uniform_real_distribution<float> across(-reach_m, reach_m);
  std::uniform_real_distribution<float> height(-1.5F, 4.0F);
  for (std::uint32_t i = 0; i < cells; ++i) {
    FineCell cell{};
    cell.ground = i % 2 == 0 ? 1 : 0;
    cell.position.x() = across(random);
    cell.position.y() = across(random);
    cell.position.z() = cell.ground != 0 ? -1.7F : height(random);
    cell.points = 1;
    record.static_cells.push_back(cell);
  }
  return {session, sequence, record.scans.back().stamp_ns, wire::encode_keyframe(record)};
}

void run(const Options& options) {
  std::optional<keys::RobotKey> key;
  std::optional<keys::KeyframeSigner> signer;
  if (!options.key.empty()) signer.emplace(key.emplace(keys::read_robot_key(options.key)));
  const SessionId id = id_of(options.name, key);
  std::shared_ptr<lcm_port::DatagramGuard> guard;
  if (key) guard = std::make_shared<keys::RobotGuard>(*key, id.boot);
  lcm_port::Publisher publisher({id, options.name, "vlp-16"},
                                lcm_port::open_link(options.url, guard), options.publisher);
  std::atomic<std::uint64_t> published = 0;
  const Clock::time_point start = Clock::now();
  const std::jthread sampler([&](const std::stop_token& stop) {
    for (bool last = false; !last;) {
      last = stop.stop_requested();
      const std::uint64_t acknowledged = publisher.counters().keyframes_acknowledged;
      std::printf("waiting %.2f %llu\n", Milliseconds(Clock::now() - start).count() * 1e-3,
                  static_cast<unsigned long long>(published - acknowledged));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  std::mt19937_64 random(options.seed);
  for (std::uint32_t i = 0; i < options.keyframes; ++i) {
    wire::EncodedKeyframe keyframe = generate(id, i, options.bytes, random);
    if (signer) signer->sign(keyframe.bytes);
    const std::size_t bytes = keyframe.bytes.size();
    const std::uint32_t checksum = wire::crc32(keyframe.bytes);
    ++published;
    publisher.publish(std::move(keyframe));
    std::printf("published %u %zu %08x\n", i, bytes, checksum);
    std::fflush(stdout);
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(
                                              (i + 1) * Milliseconds(options.period_ms)));
  }
  std::printf("acknowledged %llu\n",
              static_cast<unsigned long long>(publisher.finish().keyframes_acknowledged));
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  options.publisher.finish_timeout = std::chrono::seconds(20);
  CLI::App app{"Publishes seeded keyframes as a robot does, and says what was acknowledged."};
  app.add_option("URL", options.url, "LCM's name of the network")->required();
  app.add_option("NAME", options.name, "Of robot and session")->required();
  app.add_option("--key", options.key, "The robot's key: sign and authenticate");
  app.add_option("--keyframes", options.keyframes, "How many")->capture_default_str();
  app.add_option("--bytes", options.bytes, "Of a keyframe, about")->capture_default_str();
  app.add_option("--seed", options.seed, "Of their cells")->capture_default_str();
  app.add_option("--period-ms", options.period_ms, "From one to the next")->capture_default_str();
  app.add_option("--datagram-bytes", options.publisher.datagram_bytes, "Largest datagram")
      ->capture_default_str();
  app.add_flag("--waits", options.waits, "Wait where the queue is full, instead of dropping");
  CLI11_PARSE(app, argc, argv);
  options.publisher.drop_when_full = !options.waits;
  if (!options.key.empty()) {
    options.publisher.datagram_bytes =
        std::min(options.publisher.datagram_bytes,
                 lcm_port::kLargestDatagramBytes - lcm_port::kEnvelopeBytes);
  }
  try {
    run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_robot: %s\n", error.what());
    return 1;
  }
  return 0;
}
