// Tests of the threads of a base that localise robots or merge what it stores.
#include "ports/store/store_reader.hpp"
#include "src/apps/base/localisation_thread.hpp"
#include "src/apps/base/merge_thread.hpp"
#include "tests/apps/stored.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace std::chrono_literals;

namespace {

const SessionId kAlpha{1, {3, 11}};
const SessionId kBeta{2, {3, 12}};

/// A map of one keyframe, in which nobody is ever localised.
StoredMap small_map() {
  StoredMap map;
  map.epoch = 2;
  SessionData& session = map.sessions.emplace_back();
  session.info = {{9, {9, 9}}, "monday", "vlp-16"};
  session.keyframes.push_back(wire::wire_test::keyframe_of(session.info.id, 0));
  merge::MergedSession& merged = map.posed.sessions.emplace_back();
  merged.status = merge::SessionStatus::kCentral;
  merged.T_map_keyframe.resize(1);
  map.config.threads = 1;
  return map;
}

wire::MapPoseMessage place(const SessionId& session, std::uint32_t sequence) {
  wire::MapPoseMessage message;
  message.session = session;
  message.sequence = sequence;
  return message;
}

/// A base's store.
struct Store {
  TemporaryDirectory directory;
  std::filesystem::path folder = directory / "store";
  store::KeyframeStore kept{folder};

  void keep(std::uint32_t sequence) {
    store_keyframe(kept, wire::wire_test::keyframe_of(kAlpha, sequence));
    (void)kept.commit_all(1 + sequence);
  }
};

}  // namespace

TEST_CASE("a robot is told when its place changes, and every second") {
  DueMapPoses due;
  const DueMapPoses::Clock::time_point start(100s);
  CHECK(due.take(start).empty());
  due.put(place(kAlpha, 1));
  due.put(place(kBeta, 1));
  due.put(place(kAlpha, 2));
  const auto first = due.take(start);
  REQUIRE(first.size() == 2);
  CHECK(first[0].session == kAlpha);
  CHECK(first[0].sequence == 2);
  CHECK(due.take(start + 500ms).empty());
  due.put(place(kAlpha, 3));
  CHECK(due.take(start + 600ms).size() == 1);
  CHECK(due.take(start + 1s).size() == 1);  // beta's again
  CHECK(due.take(start + 1600ms).size() == 1);
  due.forget(kAlpha);
  CHECK(due.take(start + 3s).size() == 1);
}

TEST_CASE("a keyframe is answered soon after its commit, beside the thread that stores") {
  Store store;
  LiveLocalisationOptions options;
  options.store = store.folder;
  options.read_map = &small_map;
  options.report = [](const std::string&) {};
  LocalisationThread thread(options);
  for (std::uint32_t sequence = 0; sequence < 3; ++sequence) {
    store.keep(sequence);
    std::vector<wire::MapPoseMessage> due;
    while (due.empty()) {
      std::this_thread::sleep_for(1ms);
      due = thread.due();
      // Said again: a machine that took more than a second.
      std::erase_if(due, [&](const auto& message) { return message.sequence != sequence; });
    }
    REQUIRE(due.size() == 1);
    CHECK(due[0].session == kAlpha);
    CHECK(due[0].epoch == 2);
    CHECK(due[0].state == wire::MapPoseState::kNotYet);
    CHECK_FALSE(due[0].reason.empty());
  }
  CHECK(thread.finish().keyframes == 3);
  CHECK(unimapper::store::StoreReader(store.folder).check().empty());
}

TEST_CASE("a localisation that fails ends nothing, and is told in words") {
  const Store store;
  LiveLocalisationOptions options;
  options.store = store.folder;
  options.read_map = []() -> StoredMap { throw std::runtime_error("the disk is on fire"); };
  std::mutex mutex;
  std::string words;
  options.report = [&](const std::string& text) {
    const std::lock_guard lock(mutex);
    words += text;
  };
  LocalisationThread thread(options);
  const auto told = [&] {
    const std::lock_guard lock(mutex);
    return words;
  };
  while (told().find("the disk is on fire") == std::string::npos) {
    std::this_thread::sleep_for(1ms);
  }
  CHECK(thread.due().empty());
  CHECK(thread.finish().keyframes == 0);
}

TEST_CASE("the thread merges beside the one that stores, and what came last at its end") {
  Store store;
  LiveMergeOptions options;
  options.store = store.folder;
  options.config.threads = 2;
  options.report = [](const std::string&) {};
  MergeThread thread(std::move(options), store.kept.lock());
  for (std::uint32_t sequence = 0; sequence < 5; ++sequence) {
    store.keep(sequence);
    while (sequence == 1 && thread.due().empty()) std::this_thread::sleep_for(1ms);
  }
  CHECK(thread.finish().merges >= 2);
  const auto due = thread.due();
  REQUIRE(due.size() == 1);
  CHECK(due[0].session == kAlpha);
  CHECK(due[0].sequence == 4);
  CHECK(due[0].epoch == 1);
  unimapper::store::StoreReader reader(store.folder);
  CHECK(reader.project().epochs().size() == 1);
  CHECK(reader.check().empty());
}
