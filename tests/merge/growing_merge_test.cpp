// Tests of merges of sessions that grow
#include "src/merge/growing_merge.hpp"

#include "src/merge/sessions/session_growth.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Knows nothing and counts what was verified.
class Count final : public LoopOutcomes {
 public:
  std::size_t loops = 0;
  std::size_t placements = 0;

  void reset() { loops = placements = 0; }

  std::optional<LoopConstraint> find(const LoopQuestion&) override { return std::nullopt; }
  void keep(std::span<const Entry> entries) override { loops += entries.size(); }
  std::optional<PlacementEvidence> find(const PlacementQuestion&) override { return std::nullopt; }
  void keep(const PlacementQuestion&, const PlacementEvidence&) override { ++placements; }
};

/// Monday's drive and friday's.
const Drive& drive_of(std::size_t session) { return session == 0 ? map_of_town().drive : friday(); }

/// Both, of which so many keyframes have arrived.
struct Growing {
  std::vector<SessionData> sessions;
  GrowingMerge merge;
  Count count;

  explicit Growing(unsigned threads = 2) : merge(sessions, config_of(threads)) {
    for (const std::size_t session : {0U, 1U}) {
      sessions.push_back(drive_of(session).session);
      sessions.back().keyframes.clear();
      sessions.back().complete = false;
    }
  }
  static MergeConfig config_of(unsigned threads) {
    MergeConfig config;
    config.threads = threads;
    return config;
  }
  void arrive(std::size_t session, std::size_t until) {
    const auto& all = drive_of(session).session.keyframes;
    auto& keyframes = sessions[session].keyframes;
    for (std::size_t k = keyframes.size(); k < std::min(until, all.size()); ++k) {
      keyframes.push_back(all[k]);
    }
    sessions[session].complete = keyframes.size() == all.size();
  }
  MergeResult merge_newest() { return merge.merge_newest({}, &count); }
};

bool are_same(const MergeResult& a, const MergeResult& b) {
  const auto have_same_poses = [](const MergedSession& p, const MergedSession& q) {
    return std::equal(p.T_map_keyframe.begin(), p.T_map_keyframe.end(), q.T_map_keyframe.begin(),
                      q.T_map_keyframe.end(), [](const Pose& of_p, const Pose& of_q) {
                        return of_p.rotation == of_q.rotation &&
                               of_p.translation == of_q.translation;
                      });
  };
  return a.loops.size() == b.loops.size() &&
         std::equal(a.sessions.begin(), a.sessions.end(), b.sessions.begin(), b.sessions.end(),
                    have_same_poses);
}

/// Of friday's newest keyframe in monday's frame, against the truth.
double error_m(const MergeResult& result) {
  const auto& placed = result.sessions[1].T_map_keyframe;
  const Pose by_merge = result.sessions[0].T_map_keyframe[0].inverse() * placed.back();
  const Pose by_truth = map_of_town().drive.truth[0].inverse() * friday().truth[placed.size() - 1];
  return (by_merge.translation - by_truth.translation).norm();
}

}  // namespace

TEST_CASE("A merge of the newest keyframes verifies few loops, and what is left goes on later",
          "[growing][slow]") {
  Growing growing;
  MergeResult result;
  growing.arrive(0, 1000);
  for (std::size_t until = 10; until <= friday().session.keyframes.size() + 9; until += 10) {
    growing.arrive(1, until);
    growing.count.reset();
    result = growing.merge_newest();
    CHECK(growing.count.loops <= 16);
    CHECK(growing.count.placements <= 1);
    REQUIRE(result.sessions[1].T_map_keyframe.size() == growing.sessions[1].keyframes.size());
  }
  int merges = 0;
  std::size_t loops = result.loops.size();
  while (growing.merge.has_more()) {
    REQUIRE(++merges < 200);
    result = growing.merge_newest();
  }
  CHECK(result.loops.size() > loops);
  REQUIRE(is_in_map(result.sessions[1].status));
  CHECK(error_m(result) < 0.5);
  // Nothing is left, and nothing changes.
  growing.count.reset();
  CHECK(are_same(growing.merge_newest(), result));
  CHECK(growing.count.loops == 0);
  CHECK(growing.count.placements == 0);
}

TEST_CASE("The same growth gives the same result, for any number of threads", "[growing][slow]") {
  MergeResult results[2];
  for (const unsigned threads : {1U, 3U}) {
    Growing growing(threads);
    for (const std::size_t until : {20U, 40U, 60U}) {
      growing.arrive(0, until);
      growing.arrive(1, until / 2);
      results[threads / 3] = growing.merge_newest();
    }
  }
  CHECK_FALSE(results[0].loops.empty());
  CHECK(are_same(results[0], results[1]));
}

TEST_CASE("A merge of all loops is that of the sessions alone, and later ones know them",
          "[growing][slow]") {
  Growing growing;
  growing.arrive(0, 60);
  growing.arrive(1, 25);
  const MergeResult all = growing.merge.merge_all({}, &growing.count);
  CHECK(are_same(all, merge_poses(growing.sessions, Growing::config_of(1))));
  REQUIRE(is_in_map(all.sessions[1].status));
  growing.count.reset();
  const MergeResult next = growing.merge_newest();
  CHECK(is_in_map(next.sessions[1].status));
  CHECK(growing.count.placements == 0);
}

TEST_CASE("A keyframe that is late takes its place among the others", "[growing][slow]") {
  Growing growing;
  growing.arrive(0, 60);
  growing.arrive(1, 30);
  KeyframeRecord late = growing.sessions[1].keyframes[20];
  growing.sessions[1].keyframes.erase(growing.sessions[1].keyframes.begin() + 20);
  for (int i = 0; i < 3; ++i) (void)growing.merge_newest();
  growing.sessions[1].keyframes.insert(growing.sessions[1].keyframes.begin() + 20, late);
  MergeResult result = growing.merge_newest();
  while (growing.merge.has_more()) result = growing.merge_newest();
  REQUIRE(result.sessions[1].T_map_keyframe.size() == 30);
  REQUIRE(is_in_map(result.sessions[1].status));
  CHECK(error_m(result) < 0.5);
  for (const LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted || loop.is_intra_session()) continue;
    const auto in_map = [&](KeyframeId k) {
      return result.sessions[k.session].T_map_keyframe[k.keyframe];
    };
    const Pose by_map = in_map(loop.match).inverse() * in_map(loop.query);
    CHECK((by_map.translation - loop.T_match_query.translation).norm() < 1.0);
  }
}

TEST_CASE("Of sessions that grow only what has changed is looked at", "[growing]") {
  std::vector<SessionData> sessions{map_of_town().drive.session};
  auto& keyframes = sessions[0].keyframes;
  keyframes.resize(6);
  const KeyframeRecord third = keyframes[2];
  keyframes.erase(keyframes.begin() + 2);
  SessionGrowth growth;
  REQUIRE(growth.look(sessions).size() == 1);
  CHECK(growth.look(sessions).empty());

  keyframes.insert(keyframes.begin() + 2, third);
  const auto check_next = [&](const std::vector<std::size_t>& fresh,
                              const std::vector<std::uint32_t>& stale) {
    const std::vector<SessionChange> changes = growth.look(sessions);
    REQUIRE(changes.size() == 1);
    CHECK(changes[0].fresh == fresh);
    CHECK(changes[0].stale == stale);
    return changes[0].first;
  };
  CHECK(check_next({2}, {}) == 2);
  keyframes[4].T_odometry_keyframe.translation.x() += 1.0;
  check_next({4}, {keyframes[4].sequence});
}
