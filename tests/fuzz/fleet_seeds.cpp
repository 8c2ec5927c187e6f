// Seeds of the fuzz target of a fleet: subjects, addresses and sequences of messages.
//   fuzz_fleet_seeds FOLDER   writes FOLDER/NUMBER
#include <string>
#include <vector>

#include "ports/nats/subjects.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper;
using Data = std::vector<std::uint8_t>;

Data data_of(const std::string& text) { return {text.begin(), text.end()}; }

/// A message as fuzz_fleet reads it: proper, of one of six sessions.
Data message(bool is_keyframe, std::uint8_t session, std::uint8_t sequence) {
  const auto kind = static_cast<std::uint8_t>(is_keyframe ? 7 : 6);
  Data input{kind, session};
  if (is_keyframe) input.push_back(sequence);
  input.insert(input.end(), {0, 0, 1});
  return input;
}

void write_all(const std::filesystem::path& folder) {
  int number = 0;
  const auto write = [&](const Data& data) {
    fuzz::write_seed(folder / std::to_string(number++), data);
  };
  const SessionId id{3, {0x1122334455667788, 9}};
  write(data_of(nats_port::to_text({"north", id, 12})));
  write(data_of(nats_port::to_text({"north", id, std::nullopt})));
  write(data_of("nats://127.0.0.1:4222,tls://user@other:4222"));
  for (std::uint8_t session = 0; session < 2; ++session) {
    Data input;
    for (std::uint8_t i = 0; i < 8; ++i) {
      const Data one = message(i % 3 != 0, static_cast<std::uint8_t>(session + i / 4), i % 4);
      input.insert(input.end(), one.begin(), one.end());
    }
    write(input);
  }
}

}  // namespace

int main(int argc, char** argv) { return fuzz::write_seeds(argc, argv, write_all); }
