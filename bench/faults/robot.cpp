// Robot without a LiDAR: publishes seeded keyframes of a given size at a given rate.
//
// Prints the name of every keyframe once it is published, and at the end what became of them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "bench/faults/backlog.hpp"
#include "bench/faults/keyframes.hpp"
#include "ports/keys/guards.hpp"
#include "ports/keys/key_files.hpp"
#include "ports/keys/signature.hpp"
#include "ports/lcm/envelope.hpp"
#include "ports/lcm/live.hpp"
#include "unimapper/wire/checksum.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;
using Clock = std::chrono::steady_clock;

struct Options {
  std::string url;
  std::string name;
  std::string key;
  std::uint32_t keyframes = 60;
  std::uint64_t seed = 1;
  KeyframeSize size;
  double period_ms = 100.0;
  double finish_s = 30.0;
  bool waits = false;
  lcm_port::PublisherOptions publisher;
};

std::optional<keys::RobotKey> read_key(const std::string& file) {
  return file.empty() ? std::nullopt : std::optional(keys::read_robot_key(file));
}

/// As of a live start: the robot's number is its key's or follows from its name, the session's is
/// drawn.
SessionId id_of(const std::string& name, const std::optional<keys::RobotKey>& key) {
  std::random_device device;
  const std::uint64_t high = device();
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(name.data());
  const std::uint32_t robot = key ? key->robot : wire::crc32({bytes, name.size()});
  return {robot, high << 32U | device()};
}

std::shared_ptr<lcm_port::DatagramGuard> guard_of(const std::optional<keys::RobotKey>& key,
                                                  const SessionId& id) {
  return key ? std::make_shared<keys::RobotGuard>(*key, id.boot) : nullptr;
}

class Robot {
 public:
  explicit Robot(const Options& options)
      : options_(options),
        key_(read_key(options.key)),
        id_(id_of(options.name, key_)),
        publisher_({id_, options.name, "vlp-16"},
                   lcm_port::open_link(options.url, guard_of(key_, id_)), options.publisher),
        sampler_([this] { sample(); }) {}

  ~Robot() {
    done_ = true;
    sampler_.join();
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  void drive() {
    std::optional<keys::KeyframeSigner> signer;
    if (key_) signer.emplace(*key_);
    const Clock::time_point start = Clock::now();
    for (std::uint32_t i = 0; i < options_.keyframes; ++i) {
      wire::EncodedKeyframe keyframe = generate_keyframe(id_, i, options_.seed, options_.size);
      if (signer) signer->sign(keyframe.bytes);
      const std::string name = bench::name_of(i, keyframe.bytes);
      ++published_;
      publisher_.publish(std::move(keyframe));
      std::printf("published %s\n", name.c_str());
      std::fflush(stdout);
      std::this_thread::sleep_until(
          start + (i + 1) * std::chrono::duration_cast<Clock::duration>(
                                std::chrono::duration<double, std::milli>(options_.period_ms)));
    }
  }

  void finish() {
    const lcm_port::PublisherCounters counters = publisher_.finish();
    done_ = true;
    sampler_.join();
    sampler_ = std::thread([] {});
    const auto print = [](const char* name, std::uint64_t count) {
      std::printf("%s %llu\n", name, static_cast<unsigned long long>(count));
    };
    print("acknowledged", counters.keyframes_acknowledged);
    print("unacknowledged", counters.keyframes_unacknowledged);
    print("dropped", counters.keyframes_dropped);
    print("refused", counters.send_failures);
    print("resent", counters.pieces_resent);
    print("bytes", counters.bytes_sent);
    print("backlog", backlog_.largest());
    if (backlog_.caught_up_s()) std::printf("catch_up %.1f\n", *backlog_.caught_up_s());
  }

 private:
  void sample() {
    const Clock::time_point start = Clock::now();
    for (bool last = false; !last;) {
      last = done_;
      const std::uint64_t acknowledged = publisher_.counters().keyframes_acknowledged;
      backlog_.add(std::chrono::duration<double>(Clock::now() - start).count(), published_,
                   acknowledged);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }

  const Options& options_;
  std::optional<keys::RobotKey> key_;
  SessionId id_;
  lcm_port::Publisher publisher_;
  std::atomic<std::uint64_t> published_ = 0;
  std::atomic<bool> done_ = false;
  Backlog backlog_;  // the sampler's own until it has ended
  std::thread sampler_;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Publishes seeded keyframes as a robot does, and says what was acknowledged."};
  app.add_option("URL", options.url, "LCM's name of the network")->required();
  app.add_option("NAME", options.name, "Of robot and session")->required();
  app.add_option("--key", options.key, "The robot's key: sign and authenticate");
  app.add_option("--keyframes", options.keyframes, "How many")->capture_default_str();
  app.add_option("--bytes", options.size.bytes, "Of a keyframe, about")->capture_default_str();
  app.add_option("--seed", options.seed, "Of their cells")->capture_default_str();
  app.add_option("--period-ms", options.period_ms, "From one to the next")->capture_default_str();
  app.add_option("--finish-s", options.finish_s, "Longest time for what waits at the end")
      ->capture_default_str();
  app.add_option("--datagram-bytes", options.publisher.datagram_bytes, "Largest datagram")
      ->capture_default_str();
  app.add_option("--bytes-per-second", options.publisher.bytes_per_second, "Average rate")
      ->capture_default_str();
  app.add_option("--unacknowledged-bytes", options.publisher.unacknowledged_bytes, "Kept so long")
      ->capture_default_str();
  app.add_flag("--waits", options.waits, "Wait where the queue is full, instead of dropping");
  CLI11_PARSE(app, argc, argv);
  options.publisher.drop_when_full = !options.waits;
  if (!options.key.empty()) {
    options.publisher.datagram_bytes =
        std::min(options.publisher.datagram_bytes,
                 lcm_port::kLargestDatagramBytes - lcm_port::kEnvelopeBytes);
  }
  options.publisher.finish_timeout =
      std::chrono::milliseconds(static_cast<std::int64_t>(1000.0 * options.finish_s));
  try {
    Robot robot(options);
    robot.drive();
    robot.finish();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_robot: %s\n", error.what());
    return 1;
  }
  return 0;
}
