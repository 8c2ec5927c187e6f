// Tests of the thread of a base that merges what it stores.
#include "src/apps/base/merge_thread.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "ports/store/keyframe_store.hpp"
#include "ports/store/store_reader.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace std::chrono_literals;

namespace {

const SessionId kAlpha{1, {3, 11}};

void keep(store::KeyframeStore& kept, std::uint32_t sequence) {
  KeyframeRecord record = wire::wire_test::keyframe_of(kAlpha, sequence);
  std::vector<std::uint8_t> bytes = wire::encode_keyframe(record);
  (void)kept.keep(wire::ReceivedKeyframe{std::move(bytes), std::move(record)});
  (void)kept.commit_all(1 + sequence);
}

}  // namespace

TEST_CASE("the thread merges beside the one that stores, and what came last at its end") {
  const TemporaryDirectory directory;
  store::KeyframeStore kept(directory / "store");
  LiveMergeOptions options;
  options.store = directory / "store";
  options.config.threads = 2;
  options.report = [](const std::string&) {};
  MergeThread thread(std::move(options), kept.lock());
  for (std::uint32_t sequence = 0; sequence < 5; ++sequence) {
    keep(kept, sequence);
    while (sequence == 1 && thread.due().empty()) std::this_thread::sleep_for(1ms);
  }
  CHECK(thread.finish().merges >= 2);
  const auto due = thread.due();
  REQUIRE(due.size() == 1);
  CHECK(due[0].session == kAlpha);
  CHECK(due[0].sequence == 4);
  CHECK(due[0].epoch == 1);
  store::StoreReader reader(directory / "store");
  CHECK(reader.project().epochs().size() == 1);
  CHECK(reader.check().empty());
}
