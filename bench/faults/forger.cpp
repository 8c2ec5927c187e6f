// Forger on the robots' network: overhears messages and sends forged ones.
#include <sys/prctl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <stdexcept>
#include <string>

#include "bench/faults/forgeries.hpp"
#include "bench/faults/stop_signal.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;
using Clock = std::chrono::steady_clock;

constexpr double kLongestTurn_s = 0.05;

struct Options {
  std::string url;
  std::string kind;
  double seconds = 10.0;
  double bytes_per_second = 20e6;
};

class Forger {
 public:
  explicit Forger(const Options& options)
      : options_(options),
        link_(options.url),
        forgery_(make_forgery(options.kind, [this](std::string_view channel, wire::Bytes message) {
          send(channel, message);
        })) {
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
  void send(std::string_view channel, wire::Bytes message) {
    ++messages_;
    bytes_ += message.size();
    (void)link_.publish(std::string(channel), message.data(),
                        static_cast<unsigned int>(message.size()));
  }

  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    forgery_->overhear(channel,
                       {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  }

  const Options& options_;
  lcm::LCM link_;
  std::unique_ptr<Forgery> forgery_;
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
