// Tests of a base's merges while robots drive, on a store and without a network.
#include "src/apps/base/live_merge.hpp"

#include "ports/store/project_writer.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/map/project_merge.hpp"
#include "tests/apps/stored.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using merge::testing::Drive;
using merge::testing::friday;
using merge::testing::map_of_town;

namespace {

const Drive& monday() { return map_of_town().drive; }

/// A base's store and the merges beside it.
struct Site {
  TemporaryDirectory directory;
  std::filesystem::path folder = directory / "store";
  store::KeyframeStore kept{folder};
  std::optional<LiveMerge> live;
  LiveMerge::Clock::time_point now{};
  std::map<SessionId, wire::MapPoseMessage> told;
  std::vector<SessionId> forgotten;
  std::string words;
  std::int64_t commits = 0;

  /// A base starts.
  Site() { start(); }
  void start() {
    LiveMergeOptions options;
    options.store = folder;
    options.answered = [this](const wire::MapPoseMessage& message) {
      told[message.session] = message;
    };
    options.forgotten = [this](const SessionId& session) { forgotten.push_back(session); };
    options.report = [this](const std::string& text) { words += text + "\n"; };
    live.emplace(std::move(options), kept.lock());
  }
  /// Ten seconds later.
  void look() {
    now += 10s;
    live->advance([this] { return now; });
  }
  /// Stores keyframes [first, until) of a drive.
  void keep(const Drive& drive, std::size_t first, std::size_t until) {
    for (std::size_t k = first; k < std::min(until, drive.session.keyframes.size()); ++k) {
      store_keyframe(kept, drive.session.keyframes[k]);
    }
    commit(drive, false, 0);
  }
  void end(const Drive& drive) { commit(drive, true, drive.session.keyframes.size()); }
  void commit(const Drive& drive, bool ended, std::uint64_t announced) {
    kept.keep(wire::SessionSummary{drive.session.info.id, drive.session.info, ended, announced, 0});
    (void)kept.commit_all(++commits);
    REQUIRE(kept.trouble().empty());
  }
  [[nodiscard]] std::vector<store::Epoch> epochs() const {
    store::StoreReader reader(folder);
    CHECK(reader.check().empty());
    return reader.project().epochs();
  }
  [[nodiscard]] const wire::MapPoseMessage& told_of(const Drive& drive) const {
    return told.at(drive.session.info.id);
  }
};

}  // namespace

TEST_CASE("two robots that drive are in one frame as soon as loops connect them", "[live][slow]") {
  Site site;
  site.look();
  CHECK(site.told.empty());
  CHECK(site.epochs().empty());

  // The first robot alone: its own odometry is the map.
  site.keep(monday(), 0, 30);
  site.look();
  REQUIRE(site.told_of(monday()).state == wire::MapPoseState::kLocalised);
  CHECK(site.told_of(monday()).epoch == 1);
  CHECK(site.told_of(monday()).sequence == 29);

  // The second one begins outside of what the first has seen.
  site.keep(monday(), 30, 100);
  site.keep(friday(), 0, 4);
  site.look();
  CHECK(site.told_of(friday()).state != wire::MapPoseState::kLocalised);
  CHECK_FALSE(site.told_of(friday()).reason.empty());

  site.keep(friday(), 4, 1000);
  site.look();
  const std::size_t newest = friday().session.keyframes.size() - 1;
  const wire::MapPoseMessage& at = site.told_of(friday());
  INFO(site.words);
  REQUIRE(at.state == wire::MapPoseState::kLocalised);
  CHECK(at.sequence == newest);
  CHECK(at.loops >= 3);
  CHECK(position_sigma_m(at) < 1.0);

  // Both robots' frames fit: friday's newest keyframe from the first keyframe of monday.
  const Pose by_base = (site.told_of(monday()).T_map_odometry *
                        monday().session.keyframes.back().T_odometry_keyframe)
                           .inverse() *
                       at.T_map_odometry * friday().session.keyframes[newest].T_odometry_keyframe;
  const Pose by_truth = monday().truth.back().inverse() * friday().truth[newest];
  CHECK((by_base.translation - by_truth.translation).norm() < 0.5);

  // One epoch, however many merges it took.
  const auto epochs = site.epochs();
  REQUIRE(epochs.size() == 1);
  CHECK_THAT(epochs[0].command, Contains("base"));
  CHECK_THAT(epochs[0].outcome, Contains("merged 2 of 2 sessions"));
  CHECK(site.live->counters().growths == 3);
  CHECK_THAT(site.words, Contains("epoch 1: merged 2 of 2 sessions"));

  // Nothing new: no merge. What ended is told of for a moment.
  site.end(friday());
  site.look();
  CHECK(site.live->counters().growths == 3);
  CHECK(site.forgotten == std::vector<SessionId>{friday().session.info.id});

  // The next base has an epoch of its own, and tells of nobody who does not drive.
  site.told.clear();
  site.start();
  site.look();
  CHECK(site.epochs().size() == 2);
  CHECK(site.told.empty());
}

TEST_CASE("a keyframe takes effect with the next merge, and how soon is counted", "[live]") {
  Site site;
  site.look();
  site.keep(monday(), 0, 3);
  // Two seconds after the last look that found nothing; the merge takes three.
  site.now += 2s;
  bool is_start = true;
  site.live->advance([&] { return site.now + (std::exchange(is_start, false) ? 0s : 3s); });
  CHECK(site.live->counters().longest_merge == 3s);
  CHECK(site.live->counters().longest_effect == 5s);

  // Not before half a second after the end of the merge before.
  site.keep(monday(), 3, 4);
  site.now += 3100ms;
  site.live->advance([&] { return site.now; });
  CHECK(site.live->counters().merges == 1);
  site.live->finish();
  CHECK(site.live->counters().growths == 2);
  CHECK(site.told_of(monday()).sequence == 3);
}

TEST_CASE("in the end the map is that of a merge of the store in its frame, to the bit",
          "[live][slow]") {
  Site site;
  for (const std::size_t until : {30U, 60U, 1000U}) {
    site.keep(monday(), until - 30, until);
    site.keep(friday(), (until - 30) / 2, until / 2);
    site.look();
  }
  site.end(friday());
  site.live->finish([&site] { return site.now; });
  site.live.reset();

  store::StoreReader reader(site.folder);
  const store::MapResult kept = reader.project().result(reader.project().current().epoch.result);
  REQUIRE(kept.sessions.size() == 2);
  const std::int64_t central = kept.sessions[kept.sessions[0].state == "central" ? 0 : 1].session;

  store::ProjectWriter writer(site.folder, site.kept.lock());
  const ProjectMerge merge = merge_stored(writer, site.folder, writer.current(), {}, {}, central);
  REQUIRE(merge.stored.sessions.size() == 2);
  for (std::size_t s = 0; s < 2; ++s) {
    CHECK(merge::is_in_map(merge.result.sessions[s].status));
    CHECK(kept.sessions[s].session == merge.stored.sessions[s].session);
    CHECK(kept.sessions[s].sequences == merge.stored.sessions[s].sequences);
    CHECK(kept.sessions[s].state == merge.stored.sessions[s].state);
    const auto& of_kept = kept.sessions[s].T_map_keyframe;
    const auto& of_merge = merge.stored.sessions[s].T_map_keyframe;
    REQUIRE(of_kept.size() == of_merge.size());
    for (std::size_t k = 0; k < of_kept.size(); ++k) {
      CHECK(of_kept[k].rotation == of_merge[k].rotation);
      CHECK(of_kept[k].translation == of_merge[k].translation);
    }
  }
  CHECK(kept.loops.size() == merge.stored.loops.size());
}

TEST_CASE("what a person says between two merges stays", "[live]") {
  Site site;
  site.look();
  site.keep(monday(), 0, 3);
  site.look();
  REQUIRE(site.epochs().size() == 1);
  store::ProjectWriter writer(site.folder, site.kept.lock());
  (void)writer.commit("apart monday", [](store::ProjectState& state) {
    store::StoredStatement apart;
    apart.kind = store::StatementKind::kApart;
    apart.match.session = state.sessions.front();
    state.statements.push_back(apart);
    return std::optional<std::string>("apart");
  });
  site.keep(monday(), 3, 4);
  site.look();
  site.keep(monday(), 4, 5);
  site.look();
  const std::vector<store::Epoch> epochs = site.epochs();
  REQUIRE(epochs.size() == 3);
  CHECK(epochs[1].command == "apart monday");
  CHECK(epochs[2].command == "base --merge");
  CHECK(writer.current().statements.size() == 1);
}
