// Seeds of fuzz targets: proper keyframes, messages and configurations.
//   fuzz_seeds FOLDER   writes FOLDER/TARGET/NUMBER
#include <string>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/sending.hpp"
#include "src/apps/fleet/job_text.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/onboard/config.hpp"

namespace {

using namespace unimapper;
using Data = std::vector<std::uint8_t>;

const SessionInfo kRobot{{1, {2, 3}}, "robot", "vlp-16"};

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

/// A choice of the target, and text.
Data text_input(std::uint8_t choice, const std::string& text) {
  Data input{choice};
  input.insert(input.end(), text.begin(), text.end());
  return input;
}

Data job_input() {
  merge::LoopJob job;
  job.name = "m-0-0";
  job.limit = {4.0, 0.25};
  job.keyframes = {{{0, 1}, "1-2", Pose(), {true, 0.1F, 0.0F, 0.2F}}, {{1, 0}, "1-3", Pose(), {}}};
  job.questions = {{{1, 0}, {0, 1}, Pose(), 17}};
  return text_input(0, apps::job_text(job));
}

Data answer_input() {
  apps::JobAnswer answer{"m-0-0", "host:1", "", {{"0123", {}}, {"4567", {}}}};
  answer.outcomes[0].outcome.decision = {true, ""};
  answer.outcomes[1].outcome.decision = {false, "overlap 0.10 (limit 0.30)"};
  return text_input(1, apps::answer_text(answer));
}

void write_all(const std::filesystem::path& folder) {
  int number = 0;
  const auto write = [&](const char* target, const Data& data) {
    fuzz::write_seed(folder / target / std::to_string(number++), data);
  };
  for (std::uint32_t i = 0; i < 8; ++i) {
    KeyframeRecord record = wire::wire_test::keyframe_of(kRobot.id, i, 10 * i);
    if (i % 2 == 1) {
      for (FineCell& cell : record.static_cells) cell.intensity = static_cast<std::uint8_t>(i);
    }
    write("keyframe_codec", wire::encode_keyframe(record));
    write("receiver", receiver_input(i));
  }
  write("receiver", map_pose_input(""));
  write("receiver", map_pose_input("no loop to the map yet"));
  write("config", text_input(0, dump_config(PipelineConfig())));
  write("jobs", job_input());
  write("jobs", answer_input());
}

}  // namespace

int main(int argc, char** argv) { return fuzz::write_seeds(argc, argv, write_all); }
