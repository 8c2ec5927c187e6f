// Forger on the robots' network: overhears messages and sends forged ones.
#include <sys/prctl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/faults/forgeries.hpp"
#include "bench/faults/stop_signal.hpp"
#include "ports/keys/datagram_code.hpp"
#include "ports/keys/key_files.hpp"
#include "ports/lcm/envelope.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;
using Clock = std::chrono::steady_clock;

constexpr double kLongestTurn_s = 0.05;

struct Options {
  std::string url;
  std::string kind;
  std::string key;
  double seconds = 10.0;
  double bytes_per_second = 20e6;
};

/// Envelopes of somebody who has overheard others but has not their keys: the robot and the start
/// are right, the number is the next one, the code is made up.
class Imitation {
 public:
  void overhear(std::string_view channel, const lcm_port::Envelope& envelope) {
    Sender& sender = senders_[{channel == lcm_port::kStoredChannel, envelope.robot}];
    sender.boot = envelope.boot;
    sender.number = std::max(sender.number, envelope.number);
  }

  /// Nothing if nobody was overheard whose message it could be.
  std::optional<std::vector<std::uint8_t>> seal(std::string_view channel, wire::Bytes message) {
    const auto robot = lcm_port::robot_of(message);
    if (!robot) return std::nullopt;
    const auto sender = senders_.find({channel == lcm_port::kStoredChannel, *robot});
    if (sender == senders_.end()) return std::nullopt;
    lcm_port::Envelope envelope;
    envelope.robot = *robot;
    envelope.boot = sender->second.boot;
    envelope.number = ++sender->second.number;
    envelope.message = message;
    std::vector<std::uint8_t> datagram = lcm_port::write_envelope(envelope);
    datagram.insert(datagram.end(), lcm_port::kCodeBytes, 0x5A);
    return datagram;
  }

 private:
  struct Sender {
    BootId boot;
    std::uint64_t number = 0;
  };
  std::map<std::pair<bool, std::uint32_t>, Sender> senders_;  ///< base's answers and robots'
};

/// Envelopes of a robot that has a key, around messages in another robot's name.
class Insider {
 public:
  explicit Insider(const keys::RobotKey& key)
      : robot_(key.robot), coder_(key.link, keys::End::kRobot, boot_) {}

  std::vector<std::uint8_t> seal(std::string_view channel, wire::Bytes message) {
    std::vector<std::uint8_t> datagram =
        lcm_port::write_envelope({robot_, boot_, next_++, message, {}, {}});
    const keys::Code code = coder_.code(channel, datagram);
    datagram.insert(datagram.end(), code.begin(), code.end());
    return datagram;
  }

 private:
  std::uint32_t robot_;
  BootId boot_{std::random_device()(), std::random_device()()};
  keys::DatagramCoder coder_;
  std::uint64_t next_ = 0;
};

class Forger {
 public:
  explicit Forger(const Options& options)
      : options_(options),
        link_(options.url),
        forgery_(make_forgery(options.kind, [this](std::string_view channel, wire::Bytes message) {
          send(channel, message);
        })) {
    if (!options.key.empty()) insider_.emplace(keys::read_robot_key(options.key));
    if (!link_.good()) throw std::runtime_error(options.url + ": LCM cannot be opened");
    link_.subscribe("UNIMAPPER_.*", &Forger::on_message, this)->setQueueCapacity(4096);
  }

  void run() {
    const Clock::time_point start = Clock::now();
    double now_s = 0.0;
    while (!stop_requested() && now_s < options_.seconds) {
      if (link_.handleTimeout(5) < 0) throw std::runtime_error("LCM stopped delivering messages");
      const double last_s = now_s;
      now_s = std::chrono::duration<double>(Clock::now() - start).count();
      // What a turn took too long for is not made up for: it would take longer still.
      const double elapsed_s = std::min(now_s - last_s, kLongestTurn_s);
      forgery_->act(now_s, static_cast<std::size_t>(elapsed_s * options_.bytes_per_second));
    }
    std::printf("forged %llu messages, %llu bytes\n", static_cast<unsigned long long>(messages_),
                static_cast<unsigned long long>(bytes_));
  }

 private:
  /// As it is, in an imitated envelope, and in one of the forger's own key.
  void send(std::string_view channel, wire::Bytes message) {
    send_datagram(channel, message);
    if (forgery_->is_of_datagrams()) return;
    if (const auto imitated = imitation_.seal(channel, message)) send_datagram(channel, *imitated);
    if (insider_) send_datagram(channel, insider_->seal(channel, message));
  }

  void send_datagram(std::string_view channel, wire::Bytes datagram) {
    ++messages_;
    bytes_ += datagram.size();
    (void)link_.publish(std::string(channel), datagram.data(),
                        static_cast<unsigned int>(datagram.size()));
  }

  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    wire::Bytes message(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size);
    const auto envelope = lcm_port::read_envelope(message);
    if (envelope && !forgery_->is_of_datagrams()) {
      imitation_.overhear(channel, *envelope);
      message = envelope->message;
    }
    forgery_->overhear(channel, message);
  }

  const Options& options_;
  lcm::LCM link_;
  std::unique_ptr<Forgery> forgery_;
  Imitation imitation_;
  std::optional<Insider> insider_;
  std::uint64_t messages_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Overhears messages of robots and sends forged ones."};
  app.add_option("URL", options.url, "LCM's name of the network")->required();
  app.add_option("KIND", options.kind, "Of the forgery")
      ->required()
      ->check(CLI::IsMember(forgery_names()));
  app.add_option("--key", options.key, "Of another robot, which the forger is");
  app.add_option("--seconds", options.seconds, "Ends after so long")->capture_default_str();
  app.add_option("--bytes-per-second", options.bytes_per_second, "Of a flood")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  hold_stop_signal();
  try {
    Forger forger(options);
    std::puts("forging");
    std::fflush(stdout);
    forger.run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_forger: %s\n", error.what());
    return 1;
  }
  return 0;
}
