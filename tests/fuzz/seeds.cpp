// Seeds of fuzz targets: proper keyframes, messages and configurations.
//   fuzz_seeds FOLDER   writes FOLDER/TARGET/NUMBER
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/onboard/config.hpp"

namespace {

using namespace unimapper;
using Data = std::vector<std::uint8_t>;

const SessionInfo kRobot{{1, {2, 3}}, "robot", "vlp-16"};

class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void write(const std::string& target, const Data& data) {
    const std::filesystem::path folder = folder_ / target;
    std::filesystem::create_directories(folder);
    std::ofstream file(folder / std::to_string(number_++), std::ios::binary);
    file.write(reinterpret_cast<const char*>(data.data()),
               static_cast<std::streamsize>(data.size()));
    if (!file.flush()) throw std::runtime_error(folder.string() + ": cannot be written");
  }

 private:
  std::filesystem::path folder_;
  int number_ = 0;
};

std::vector<Data> messages(std::uint32_t sequence) {
  const KeyframeRecord record = wire::wire_test::keyframe_of(kRobot.id, sequence, 20);
  std::vector<Data> all =
      lcm_port::cut_into_messages(wire::wire_test::encode_for_sending(record), 256);
  all.insert(all.begin(),
             lcm_port::encode({kRobot, wire::SessionState::kRunning, sequence + 1ULL, 0}));
  return all;
}

/// As fuzz_receiver reads it: what to do with a message, its length, its bytes.
Data receiver_input(std::uint32_t sequence) {
  Data input;
  for (const Data& message : messages(sequence)) {
    if (message.size() > 255) continue;
    input.push_back(input.empty() ? 0 : 7);
    input.push_back(static_cast<std::uint8_t>(message.size()));
    input.insert(input.end(), message.begin(), message.end());
  }
  return input;
}

/// A place in the map of the session that fuzz_receiver knows, likewise, but for its end after it.
Data map_pose_input(const std::string& reason) {
  const SessionId victim{7, {0x1122334455667788, 0x99AABBCCDDEEFF00}};
  wire::MapPoseMessage place = lcm_port::lcm_test::map_pose_of(victim, 3, 5);
  place.reason = reason;
  Data input{2 | 8, 255};
  const Data message = lcm_port::encode(place);
  input.insert(input.end(), message.begin(), message.end());
  return input;
}

Data config_input() {
  const std::string text = dump_config(PipelineConfig());
  Data input{0};
  input.insert(input.end(), text.begin(), text.end());
  return input;
}

void write_all(Seeds& seeds) {
  for (std::uint32_t i = 0; i < 8; ++i) {
    const KeyframeRecord record = wire::wire_test::keyframe_of(kRobot.id, i, 10 * i);
    seeds.write("keyframe_codec", wire::encode_keyframe(record));
    seeds.write("receiver", receiver_input(i));
  }
  seeds.write("receiver", map_pose_input(""));
  seeds.write("receiver", map_pose_input("no loop to the map yet"));
  seeds.write("config", config_input());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fuzz_seeds FOLDER\n", stderr);
    return 2;
  }
  try {
    Seeds seeds(argv[1]);
    write_all(seeds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
