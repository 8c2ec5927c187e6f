// Benchmark of authentication: milliseconds that keys cost per keyframe.
//   bench_keys BYTES [DATAGRAM_BYTES]
//
// Of an Ethernet frame's datagrams or large ones: signature and codes at the robot, codes and
// signature at the base. Time is the processor's, of the fastest of many runs: other load on the
// machine counts least.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "ports/keys/guards.hpp"
#include "ports/keys/signature.hpp"
#include "ports/lcm/messages.hpp"
#include "ports/lcm/sending.hpp"
#include "unimapper/core/voxel_key.hpp"

namespace {

using namespace unimapper;
using Data = std::vector<std::uint8_t>;

constexpr int kRepeats = 200;

double processor_ms() {
  timespec now = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

void print_best(const char* name, const std::function<void()>& work) {
  double best = 1e300;
  for (int i = 0; i < kRepeats; ++i) {
    const double start = processor_ms();
    work();
    best = std::min(best, processor_ms() - start);
  }
  std::printf("%s  %.3f\n", name, best);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::puts("usage: bench_keys BYTES [DATAGRAM_BYTES]"), 2;
  const auto datagram_bytes =
      argc > 2 ? static_cast<std::uint32_t>(std::atoi(argv[2])) : lcm_port::kLargestDatagramBytes;
  Data bytes(static_cast<std::size_t>(std::atoll(argv[1])));
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(mix_bits(i));

  const keys::RobotKey key = keys::new_robot_key("robot");
  const keys::BaseKey base_key = keys::base_key_of(key);
  const SessionId id{key.robot, {1, 2}};
  const keys::KeyframeSigner signer(key);
  keys::RobotGuard robot(key, id.boot);
  keys::BaseGuard base(std::vector{base_key}, {3, 4});

  Data signed_bytes;
  print_best("sign ms", [&] {
    signed_bytes = bytes;
    signer.sign(signed_bytes);
  });
  const auto messages = lcm_port::cut_into_messages({id, 0, 0, signed_bytes},
                                                    datagram_bytes - lcm_port::kEnvelopeBytes);
  std::vector<Data> sealed;
  print_best("codes at the robot ms", [&] {
    sealed.clear();
    for (const Data& message : messages) {
      sealed.push_back(*robot.seal(lcm_port::kKeyframeChannel, message));
    }
  });
  std::vector<std::vector<Data>> rounds;
  for (int i = 0; i < kRepeats; ++i) {
    for (const Data& message : messages) {
      if (rounds.size() == static_cast<std::size_t>(i)) rounds.emplace_back();
      rounds.back().push_back(*robot.seal(lcm_port::kKeyframeChannel, message));
    }
  }
  std::size_t round = 0;
  print_best("codes at the base ms", [&] {
    for (const Data& datagram : rounds[round]) {
      (void)base.open(lcm_port::kKeyframeChannel, datagram);
    }
    ++round;
  });
  print_best("check the signature ms",
             [&] { (void)keys::is_signed_by(base_key.verifying, signed_bytes); });
  return base.counters().refused() == 0 ? 0 : 1;
}
