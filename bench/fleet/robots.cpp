// Robots of one site without LiDARs: send the keyframes of a store, each robot under a name of its
// own.
//
// Prints "sent COUNT late SECONDS" at the end: how many keyframes were acknowledged, and how much
// later than it should have been the last one could be handed over.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "ports/lcm/live.hpp"
#include "ports/store/store_reader.hpp"
#include "src/wire/span_writer.hpp"

namespace {

using namespace unimapper;
using Clock = std::chrono::steady_clock;

struct Options {
  std::string url;
  std::string store;
  std::uint32_t first = 0;
  std::uint32_t robots = 1;
  std::uint32_t keyframes = 60;
  double period_ms = 1000.0;
};

/// One socket for all robots: each hears what is said to it.
class SharedLink {
 public:
  explicit SharedLink(const std::string& url) : link_(lcm_port::open_link(url)) {}

  lcm_port::Link of(const SessionId& session) {
    return {link_.send, [this, session] { return take(stored_, session); },
            [this, session] { return take(receipts_, session); }};
  }

 private:
  template <typename Message>
  using Heard = std::map<SessionId, std::vector<Message>>;

  template <typename Message>
  std::vector<Message> take(Heard<Message>& heard, const SessionId& session) {
    const std::lock_guard lock(mutex_);
    for (auto& message : link_.receive()) stored_[message.session].push_back(message);
    for (auto& receipt : link_.receipts()) receipts_[receipt.message.session].push_back(receipt);
    return std::exchange(heard[session], {});
  }

  lcm_port::Link link_;
  std::mutex mutex_;
  Heard<lcm_port::StoredMessage> stored_;
  Heard<lcm_port::ReceivedReceipt> receipts_;
};

std::vector<std::vector<std::uint8_t>> keyframes_of(const std::string& folder) {
  store::StoreReader reader(folder);
  std::vector<std::vector<std::uint8_t>> all;
  for (const store::SessionListing& session : reader.sessions()) {
    reader.for_each_keyframe(session, [&all](store::StoredKeyframe&& keyframe) {
      all.push_back(std::move(keyframe.bytes));
    });
  }
  if (all.empty()) throw std::runtime_error(folder + ": holds no keyframe");
  return all;
}

/// The same keyframe of another session: who it is from stands in front (docs/wire-format.md).
wire::EncodedKeyframe renamed(const std::vector<std::uint8_t>& bytes, const SessionId& id,
                              std::uint32_t sequence) {
  constexpr std::size_t kPlace = 8;
  wire::EncodedKeyframe keyframe{id, sequence, 0, bytes};
  wire::SpanWriter out(std::span(keyframe.bytes).subspan(kPlace));
  out.put(id.robot);
  out.put(id.boot.low);
  out.put(id.boot.high);
  out.put(sequence);
  return keyframe;
}

void run(const Options& options) {
  const auto keyframes = keyframes_of(options.store);
  SharedLink link(options.url);
  std::random_device random;
  lcm_port::PublisherOptions sending;
  sending.drop_when_full = false;
  sending.finish_timeout = std::chrono::seconds(60);
  std::vector<SessionId> ids;
  std::vector<std::unique_ptr<lcm_port::Publisher>> robots;
  for (std::uint32_t i = 0; i < options.robots; ++i) {
    ids.push_back({options.first + i, std::uint64_t{random()} << 32U | random()});
    const SessionInfo info{ids[i], "robot" + std::to_string(options.first + i), "vlp-16"};
    robots.push_back(std::make_unique<lcm_port::Publisher>(info, link.of(ids[i]), sending));
  }
  // One after the other within a period, as robots are not in step.
  const std::uint64_t turns = std::uint64_t{options.keyframes} * options.robots;
  const std::chrono::duration<double, std::milli> pause(options.period_ms / options.robots);
  const Clock::time_point start = Clock::now();
  Clock::time_point due = start;
  for (std::uint64_t turn = 0; turn < turns; ++turn) {
    due = start + std::chrono::duration_cast<Clock::duration>(pause * static_cast<double>(turn));
    std::this_thread::sleep_until(due);
    const auto robot = static_cast<std::size_t>(turn % options.robots);
    const auto number = static_cast<std::uint32_t>(turn / options.robots);
    robots[robot]->publish(renamed(keyframes[number % keyframes.size()], ids[robot], number));
  }
  const std::chrono::duration<double> late = Clock::now() - due;
  std::uint64_t sent = 0;
  for (const auto& robot : robots) sent += robot->finish().keyframes_acknowledged;
  std::printf("sent %llu late %.1f\n", static_cast<unsigned long long>(sent), late.count());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Sends stored keyframes as robots do, and says how many were acknowledged."};
  app.add_option("URL", options.url, "LCM's name of the network")->required();
  app.add_option("STORE", options.store, "Store whose keyframes are sent")->required();
  app.add_option("--first", options.first, "Number of the first robot")->capture_default_str();
  app.add_option("--robots", options.robots, "How many")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--keyframes", options.keyframes, "Of each robot")->capture_default_str();
  app.add_option("--period-ms", options.period_ms, "From one to the next")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fleet_robots: %s\n", error.what());
    return 1;
  }
  return 0;
}
