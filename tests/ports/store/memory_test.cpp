// Test of a base's memory over a long drive.
#include "tests/ports/store/base.hpp"
#include "tests/ports/store/memory_folder.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

namespace {

/// Memory of this process that is in use, kB.
std::int64_t resident_kb() {
  std::ifstream file("/proc/self/status");
  std::string word;
  std::int64_t kilobytes = 0;
  while (file >> word) {
    if (word == "VmRSS:" && file >> kilobytes) return kilobytes;
  }
  return 0;
}

/// The smallest keyframe there is, a few hundred bytes.
wire_test::Message small_keyframe(const SessionId& id, std::uint32_t sequence) {
  KeyframeRecord record;
  record.session = id;
  record.sequence = sequence;
  record.scans.resize(1);
  auto pieces = wire::cut_into_pieces(wire_test::encode_for_sending(record), 60000);
  return std::move(pieces.front());
}

}  // namespace

TEST_CASE("memory does not grow with what is stored") {
  const MemoryFolder folder;
  StoreOptions options;
  options.batch_keyframes = 256;
  Base base(folder.path(), options);
  const auto drive = [&base](std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t sequence = from; sequence < to; ++sequence) {
      for (std::uint32_t robot = 1; robot <= 5; ++robot) {
        wire_test::feed(base.receiver, small_keyframe({robot, robot}, sequence));
      }
    }
    base.advance();
  };
  drive(0, 1000);
  const std::int64_t before = resident_kb();
  REQUIRE(before > 0);
  drive(1000, 5000);
  // Decoded records of 20,000 keyframes would take at least 10 MB.
  CHECK(resident_kb() - before < 5000);
  CHECK(base.store.counters().keyframes == 25000);
  for (const auto& [session, below] : base.acknowledged()) CHECK(below == 5000);
  CHECK(StoreReader(folder.path()).check().empty());
}
