// Tests of a base's localisation of robots, on a store and without a network.
#include "src/apps/base/live_localisation.hpp"

#include "ports/store/database.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/upper_triangle.hpp"
#include "tests/apps/stored.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using merge::testing::friday;
using merge::testing::map_of_town;

namespace {

constexpr std::int64_t kEpoch = 5;

StoredMap map_in_store() {
  return {kEpoch, {1}, {map_of_town().drive.session}, map_of_town().result, {}, {}};
}

/// A keyframe of Friday's drive as another session brings it.
KeyframeRecord keyframe(std::uint32_t sequence, const SessionId& session) {
  KeyframeRecord record = friday().session.keyframes.at(sequence);
  record.session = session;
  return record;
}

const SessionId kAlpha{1, {3, 11}};
const SessionId kBeta{2, {3, 12}};

/// A base's store and the localisation beside it.
struct Site {
  TemporaryDirectory directory;
  std::unique_ptr<store::KeyframeStore> kept =
      std::make_unique<store::KeyframeStore>(directory / "store");
  LiveLocalisation::Clock::time_point now{};
  std::vector<wire::MapPoseMessage> answers;
  std::vector<SessionId> forgotten;
  std::string words;
  std::function<StoredMap()> read_map = &map_in_store;
  std::size_t max_sessions = 4;
  std::optional<LiveLocalisation> live;
  bool is_damaged = false;

  ~Site() {
    if (std::filesystem::exists(directory / "store")) {
      CHECK(store::StoreReader(directory / "store").check().empty() != is_damaged);
    }
  }

  /// A base starts, or starts again.
  void start() {
    LiveLocalisationOptions options;
    options.store = directory / "store";
    options.max_sessions = max_sessions;
    options.read_map = [this] { return read_map(); };
    options.answered = [this](const wire::MapPoseMessage& message) { answers.push_back(message); };
    options.forgotten = [this](const SessionId& session) { forgotten.push_back(session); };
    options.report = [this](const std::string& text) { words += text + "\n"; };
    live.emplace(std::move(options));
    look();
  }
  void look() {
    while (live->advance(now)) continue;
  }
  /// Stored together.
  void keep(const std::vector<std::uint32_t>& sequences, const SessionId& session = kAlpha) {
    for (const std::uint32_t sequence : sequences) {
      store_keyframe(*kept, keyframe(sequence, session));
    }
    (void)kept->commit_all(++commits);
    REQUIRE(kept->trouble().empty());
  }
  /// Stored, and looked at.
  void hear(const std::vector<std::uint32_t>& sequences, const SessionId& session = kAlpha) {
    keep(sequences, session);
    look();
  }
  /// So much time passes.
  void wait(LiveLocalisation::Clock::duration time) {
    now += time;
    look();
  }
  void keep_state(const SessionInfo& info, bool ended) {
    kept->keep(wire::SessionSummary{info.id, info, ended, 0, 0});
    (void)kept->commit_all(++commits);
  }
  std::int64_t commits = 0;
};

std::vector<std::uint32_t> numbers(std::uint32_t first, std::uint32_t until) {
  std::vector<std::uint32_t> all(until - first);
  std::iota(all.begin(), all.end(), first);
  return all;
}

/// What a localiser says of these keyframes, as they are stored.
std::vector<merge::MapPose> direct(const std::vector<std::uint32_t>& sequences) {
  merge::Localiser localiser = map_of_town().localiser();
  std::vector<merge::MapPose> answers;
  for (const std::uint32_t sequence : sequences) {
    auto stored = wire::decode_keyframe(wire::encode_keyframe(keyframe(sequence, kAlpha)));
    answers.push_back(localiser.add(std::move(*stored.record)));
  }
  return answers;
}

const std::vector<merge::MapPose>& direct_answers() {
  static const std::vector<merge::MapPose> shared =
      direct(numbers(0, static_cast<std::uint32_t>(friday().session.keyframes.size())));
  return shared;
}

void check_same(const wire::MapPoseMessage& told, const merge::MapPose& at) {
  CHECK(static_cast<int>(told.state) == static_cast<int>(at.state));
  CHECK(told.reason == at.reason);
  CHECK(told.T_map_odometry.translation == at.T_map_odometry.translation);
  CHECK(told.T_map_odometry.rotation == at.T_map_odometry.rotation);
  CHECK(told.covariance == upper_triangle(at.covariance));
  CHECK(told.loops == at.loops);
  CHECK(told.since_loop_m == at.since_loop_m);
}

}  // namespace

TEST_CASE("a robot is told of each keyframe what the localiser says of it", "[live][slow]") {
  Site site;
  site.start();
  CHECK_THAT(site.words, Contains("robots are localised in the map of epoch 5"));
  const auto count = static_cast<std::uint32_t>(direct_answers().size());
  site.keep_state({kAlpha, "friday", "os2-128"}, false);
  for (std::uint32_t first = 0; first < count; first += 6) {
    site.hear(numbers(first, std::min(count, first + 6)));
  }
  REQUIRE(site.answers.size() == count);
  for (std::uint32_t i = 0; i < count; ++i) {
    INFO("keyframe " << i);
    CHECK(site.answers[i].session == kAlpha);
    CHECK(site.answers[i].epoch == kEpoch);
    CHECK(site.answers[i].sequence == i);
    CHECK(site.answers[i].stamp_ns == friday().session.keyframes[i].scans[1].stamp_ns);
    check_same(site.answers[i], direct_answers()[i]);
  }
  CHECK(site.answers.back().state == wire::MapPoseState::kLocalised);
  const auto at = site.words.find("(robot 1) is localised in the map of epoch 5 by ");
  CHECK(at != std::string::npos);
  CHECK(site.words.find("is localised", at + 12) == std::string::npos);
  CHECK(site.live->counters().keyframes == count);
  CHECK(site.live->counters().late == 0);
}

TEST_CASE("a keyframe that arrives after a later one is left out and counted", "[live]") {
  Site site;
  site.start();
  site.hear({0, 1, 2});
  site.hear({5, 4});  // together: in order
  site.hear({3, 6});
  const std::vector<std::uint32_t> taken = {0, 1, 2, 4, 5, 6};
  const auto expected = direct(taken);
  REQUIRE(site.answers.size() == taken.size());
  for (std::size_t i = 0; i < taken.size(); ++i) {
    CHECK(site.answers[i].sequence == taken[i]);
    check_same(site.answers[i], expected[i]);
  }
  CHECK(site.live->counters().late == 1);
}

TEST_CASE("a base that restarts goes on with a robot at its next keyframe", "[live][slow]") {
  const auto count = static_cast<std::uint32_t>(direct_answers().size());
  Site site;
  site.start();
  site.keep(numbers(0, count - 1));
  site.answers.clear();
  site.start();
  CHECK(site.answers.empty());
  site.hear({count - 1});
  // Of what was before, it is told nothing again.
  REQUIRE(site.answers.size() == 1);
  CHECK(site.answers[0].sequence == count - 1);
  check_same(site.answers[0], direct_answers().back());
  CHECK(site.live->counters().keyframes == count);
  CHECK(site.live->counters().late == 0);
}

TEST_CASE("without a map the base says so once, and finds one that comes later", "[live]") {
  Site site;
  bool has_map = false;
  int reads = 0;
  site.read_map = [&]() -> StoredMap {
    ++reads;
    if (!has_map) throw std::runtime_error("site: there is no map in epoch 1");
    return map_in_store();
  };
  site.start();
  CHECK_THAT(site.words, Contains("robots are not localised: site: there is no map in epoch 1"));
  site.words.clear();
  site.hear({0});
  CHECK(reads == 1);
  CHECK(site.answers.empty());
  has_map = true;
  site.now += 11s;
  site.hear({1});
  REQUIRE(site.answers.size() == 1);
  CHECK(site.answers[0].sequence == 1);
  CHECK(site.words == "robots are localised in the map of epoch 5\n");
  // With the keyframe before.
  CHECK(site.live->counters().keyframes == 2);
}

TEST_CASE("a damaged keyframe is told and left out, and others are answered", "[live]") {
  Site site;
  site.start();
  site.keep({0, 1, 2});
  store::Database(store::database_of(site.directory / "store"), store::Access::kWrite)
      .run("UPDATE keyframes SET bytes = zeroblob(length(bytes)) WHERE sequence = 1");
  site.is_damaged = true;
  site.look();
  const auto expected = direct({0, 2});
  REQUIRE(site.answers.size() == 2);
  check_same(site.answers[1], expected[1]);
  CHECK_THAT(site.words, Contains("keyframe 1 of") && Contains("it is damaged in the store"));
  CHECK(site.live->counters().unusable == 1);
  CHECK(site.live->counters().late == 0);
}

TEST_CASE("sessions beyond the bound are refused and told once, until one is quiet", "[live]") {
  Site site;
  site.max_sessions = 1;
  site.start();
  site.hear({0}, kAlpha);
  site.hear({0}, kBeta);
  CHECK(site.answers.size() == 1);
  CHECK_THAT(site.words, Contains("(robot 2) is not localised: 1 sessions are"));
  site.words.clear();
  site.hear({1}, kBeta);
  CHECK(site.words.empty());
  CHECK(site.live->counters().sessions_refused == 2);
  site.now += 31s;
  site.hear({2}, kBeta);
  CHECK(site.forgotten == std::vector<SessionId>{kAlpha});
  REQUIRE(site.answers.size() == 2);
  CHECK(site.answers[1].session == kBeta);
  CHECK(site.answers[1].sequence == 2);
}

TEST_CASE("a session is forgotten after its end or ten minutes, and taken up again", "[live]") {
  Site site;
  site.start();
  site.keep({0, 1});
  site.keep_state({kAlpha, "friday", "os2-128"}, true);
  site.look();
  CHECK(site.answers.size() == 2);
  CHECK(site.forgotten.empty());
  site.wait(4s);
  CHECK(site.forgotten == std::vector<SessionId>{kAlpha});
  site.hear({2});
  REQUIRE(site.answers.size() == 3);
  CHECK(site.answers[2].sequence == 2);
  CHECK(site.live->counters().keyframes == 5);
  // A robot that stands still, its session not ended
  site.hear({0}, kBeta);
  site.wait(9min);
  CHECK(site.forgotten == std::vector<SessionId>{kAlpha, kAlpha});
  site.wait(1min);
  CHECK(site.forgotten.back() == kBeta);
}
