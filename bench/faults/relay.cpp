// Relay between the robots' multicast group and the base's, with seeded faults in each direction.
#include <poll.h>
#include <sys/prctl.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <queue>
#include <string>
#include <vector>

#include "bench/faults/faults.hpp"
#include "bench/faults/multicast.hpp"

namespace {

using namespace unimapper::bench;
using Clock = std::chrono::steady_clock;
using Datagram = std::vector<std::uint8_t>;

volatile std::sig_atomic_t stopped = 0;

void stop(int /*signal*/) { stopped = 1; }

constexpr std::uint64_t kMaxHeldBytes = 256U << 20U;
constexpr int kMaxDrained = 64;
constexpr std::chrono::milliseconds kTurn{50};

struct Options {
  std::string robots = "239.255.76.67:7667";
  std::string base = "239.255.76.68:7668";
  std::string to_base;
  std::string to_robots;
  std::uint64_t seed = 1;
  double seconds = 1200.0;
};

struct Counters {
  std::uint64_t received = 0;
  std::uint64_t forwarded = 0;
  std::uint64_t dropped = 0;
  std::uint64_t down = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t reordered = 0;
  std::uint64_t flipped = 0;
  std::uint64_t overflowed = 0;
};

class Relay {
 public:
  explicit Relay(const Options& options)
      : robots_(options.robots),
        base_(options.base),
        to_base_{robots_, base_, {parse_faults(options.to_base), options.seed}, {}},
        to_robots_{base_, robots_, {parse_faults(options.to_robots), options.seed + 1}, {}} {}

  void run(Clock::time_point end) {
    while (stopped == 0 && Clock::now() < end) {
      wait();
      drain(to_base_);
      drain(to_robots_);
      send_due();
    }
  }

  void print() const {
    print("to_base", to_base_);
    print("to_robots", to_robots_);
  }

 private:
  struct Direction {
    MulticastEnd& from;
    MulticastEnd& to;
    FaultyDirection faults;
    Counters counters;
  };
  struct Held {
    Clock::time_point due;
    std::uint64_t number;
    Direction* direction;
    Datagram datagram;
    bool operator>(const Held& other) const {
      return due != other.due ? due > other.due : number > other.number;
    }
  };

  void wait() {
    auto patience = Clock::now() + kTurn;
    if (!held_.empty()) patience = std::min(patience, held_.top().due);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(patience - Clock::now());
    pollfd ends[] = {{robots_.listening(), POLLIN, 0}, {base_.listening(), POLLIN, 0}};
    (void)poll(ends, 2, std::max(0, static_cast<int>(left.count())));
  }

  void drain(Direction& direction) {
    Datagram datagram;
    for (int i = 0; i < kMaxDrained && direction.from.receive(datagram); ++i) {
      take(direction, datagram);
    }
  }

  void take(Direction& direction, Datagram& datagram) {
    const Clock::time_point now = Clock::now();
    if (!started_) start_ = now;
    started_ = true;
    const Fate fate =
        direction.faults.next(datagram.size(), std::chrono::duration<double>(now - start_).count());
    Counters& counters = direction.counters;
    ++counters.received;
    counters.down += fate.down ? 1 : 0;
    counters.dropped += fate.copies == 0 && !fate.down ? 1 : 0;
    counters.duplicated += fate.copies == 2 ? 1 : 0;
    counters.reordered += fate.reordered ? 1 : 0;
    if (fate.copies > 0 && fate.flip_bit) {
      ++counters.flipped;
      const std::uint64_t bit = *fate.flip_bit % (8 * datagram.size());
      datagram[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
    for (std::size_t copy = 0; copy < fate.copies; ++copy) {
      hold(direction, datagram,
           now + std::chrono::duration_cast<Clock::duration>(
                     std::chrono::duration<double, std::milli>(fate.delay_ms[copy])));
    }
  }

  void hold(Direction& direction, const Datagram& datagram, Clock::time_point due) {
    if (held_bytes_ + datagram.size() > kMaxHeldBytes) {
      ++direction.counters.overflowed;
      return;
    }
    held_bytes_ += datagram.size();
    held_.push({due, ++number_, &direction, datagram});
  }

  void send_due() {
    while (!held_.empty() && held_.top().due <= Clock::now()) {
      const Held& next = held_.top();
      const bool sent = next.direction->to.send(next.datagram);
      ++(sent ? next.direction->counters.forwarded : next.direction->counters.overflowed);
      held_bytes_ -= next.datagram.size();
      held_.pop();
    }
  }

  static void print(const char* name, const Direction& direction) {
    const auto number = [](std::uint64_t count) { return static_cast<unsigned long long>(count); };
    const Counters& c = direction.counters;
    std::printf(
        "%s received %llu forwarded %llu dropped %llu down %llu duplicated %llu reordered %llu "
        "flipped %llu overflowed %llu\n",
        name, number(c.received), number(c.forwarded), number(c.dropped), number(c.down),
        number(c.duplicated), number(c.reordered), number(c.flipped),
        number(c.overflowed + direction.from.overflowed()));
  }

  MulticastEnd robots_;
  MulticastEnd base_;
  Direction to_base_;
  Direction to_robots_;
  std::priority_queue<Held, std::vector<Held>, std::greater<>> held_;
  std::uint64_t held_bytes_ = 0;
  std::uint64_t number_ = 0;
  bool started_ = false;
  Clock::time_point start_;
};

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "Relays datagrams between two multicast groups with faults such as drop=0.05,delay=10 or "
      "down=4+45; ends with its parent, on SIGTERM, or after --seconds."};
  app.add_option("--robots", options.robots, "The robots' GROUP:PORT")->capture_default_str();
  app.add_option("--base", options.base, "The base's GROUP:PORT")->capture_default_str();
  app.add_option("--to-base", options.to_base, "Faults of what robots send");
  app.add_option("--to-robots", options.to_robots, "Faults of what the base sends");
  app.add_option("--seed", options.seed, "Of every decision")->capture_default_str();
  app.add_option("--seconds", options.seconds, "Longest time")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  std::signal(SIGTERM, stop);
  std::signal(SIGINT, stop);
  try {
    Relay relay(options);
    std::puts("relaying");
    std::fflush(stdout);
    relay.run(Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(options.seconds)));
    relay.print();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_relay: %s\n", error.what());
    return 1;
  }
  return 0;
}
