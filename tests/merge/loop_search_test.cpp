// Loop candidates by descriptor and by distance: every condition just met and just missed
#include "src/merge/loops/loop_search.hpp"

#include "src/merge/loops/radius_search.hpp"
#include "src/merge/loops/verification_rounds.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/test.hpp"
#include "unimapper/place/database.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Keyframes along a street, `step_m` apart.
std::vector<Pose> crawl(std::size_t count, double step_m) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back(shifted(6.0 + step_m * static_cast<double>(i), 0.0, 1.7));
  }
  return poses;
}

SessionData recorded(const std::vector<Pose>& poses, std::uint64_t seed) {
  static const Town town = make_town(5, 1);
  return record(town, poses, "session " + std::to_string(seed), seed).session;
}

/// So many sessions along the same street.
std::vector<SessionData> crawled(std::size_t sessions, std::size_t count, double step_m) {
  std::vector<SessionData> made;
  for (std::uint64_t s = 1; s <= sessions; ++s) made.push_back(recorded(crawl(count, step_m), s));
  return made;
}

/// Loops of keyframes three apart.
LoopConfig close_config() {
  LoopConfig config;
  config.min_keyframe_gap = 3;
  config.min_path_gap_m = 0.0;
  return config;
}

/// `some` are the first ones of `all`.
void check_first(const std::vector<LoopCandidate>& all, const std::vector<LoopCandidate>& some,
                 std::size_t count) {
  REQUIRE(some.size() == count);
  REQUIRE(all.size() >= count);
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(some[i].query == all[i].query);
    CHECK(some[i].match == all[i].match);
  }
}

/// The most candidates of one keyframe in one session.
std::size_t most_proposed(const std::vector<LoopCandidate>& candidates) {
  std::map<std::pair<KeyframeId, std::size_t>, std::size_t> proposed;
  std::size_t most = 0;
  for (const LoopCandidate& loop : candidates) {
    most = std::max(most, ++proposed[{loop.query, loop.match.session}]);
  }
  return most;
}

Pose at(double x, double y, double yaw = 0.0) { return yaw_pose(yaw, {x, y, 0.0}); }

/// Sessions whose maps are aligned, but for one, their keyframes where odometry says.
struct Aligned {
  std::vector<SessionData> sessions{2};
  std::optional<std::size_t> unconnected;

  void add(std::size_t session, const Pose& pose) {
    KeyframeRecord& keyframe = sessions[session].keyframes.emplace_back();
    keyframe.sequence = static_cast<std::uint32_t>(sessions[session].keyframes.size() - 1);
    keyframe.T_odometry_keyframe = pose;
  }
  [[nodiscard]] std::vector<LoopCandidate> search(
      const MergeConfig& config = {}, const std::vector<LoopConstraint>& known = {}) const {
    Alignment alignment;
    alignment.T_map_session.resize(sessions.size());
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      alignment.connected.push_back(s != unconnected);
      std::vector<Pose>& poses = alignment.T_session_keyframe.emplace_back();
      for (const auto& keyframe : sessions[s].keyframes) {
        poses.push_back(keyframe.T_odometry_keyframe);
      }
    }
    return find_radius_candidates(sessions, alignment, known, config);
  }
};

}  // namespace

TEST_CASE("A slow robot closes no loop with where it was a moment ago", "[loop_search]") {
  const std::vector<SessionData> sessions{
      record(make_town(5, 1), crawl(24, 0.5), "slow", 1, 0.0, 0.0).session};
  LoopConfig config;
  config.min_keyframe_gap = 15;
  // The farthest two keyframes are 11.5 m of path apart.
  config.min_path_gap_m = 11.0;
  for (const LoopCandidate& loop : find_intra_session_candidates(sessions, config, 1)) {
    CHECK(loop.query.keyframe - loop.match.keyframe >= 22);
  }
  config.min_path_gap_m = 12.0;
  CHECK(find_intra_session_candidates(sessions, config, 1).empty());
  config.min_path_gap_m = 0.0;
  const auto all = find_intra_session_candidates(sessions, config, 1);
  CHECK_FALSE(all.empty());
  for (const LoopCandidate& loop : all) {
    CHECK(loop.query.session == 0);
    CHECK(loop.query.keyframe - loop.match.keyframe >= 15);
  }
}

TEST_CASE("As many candidates are proposed as configured per pair of sessions", "[loop_search]") {
  const std::vector<SessionData> sessions = crawled(2, 10, 2.0);
  LoopConfig config;
  const auto many = find_inter_session_candidates(sessions, config);
  REQUIRE(many.size() > 10);
  for (const LoopCandidate& loop : many) CHECK(loop.query.session != loop.match.session);
  config.max_candidates_per_pair = 7;
  const auto best = find_inter_session_candidates(sessions, config);
  check_first(many, best, 7);
  for (std::size_t i = 1; i < 7; ++i) CHECK((best[i - 1].accepted || !best[i].accepted));
}

TEST_CASE("A keyframe proposes exactly three candidates of another session", "[loop_search]") {
  const auto candidates = find_inter_session_candidates(crawled(3, 10, 2.0), LoopConfig{});
  CHECK(most_proposed(candidates) == 3);
  std::map<std::pair<std::size_t, std::size_t>, std::set<KeyframeId>> taken_part;
  std::set<std::pair<KeyframeId, KeyframeId>> pairs;
  for (const LoopCandidate& loop : candidates) {
    const auto keyframes = std::minmax(loop.query, loop.match);
    // Both directions of a pair of keyframes meet in one candidate.
    CHECK(pairs.insert(keyframes).second);
    taken_part[{keyframes.first.session, keyframes.second.session}].insert(
        {keyframes.first, keyframes.second});
  }
  // Every keyframe has its own best candidate in each of the other sessions.
  CHECK(taken_part[{0, 1}].size() == 20);
  CHECK(taken_part[{0, 2}].size() == 20);
  CHECK(taken_part[{1, 2}].size() == 20);
}

TEST_CASE("A keyframe proposes exactly three candidates of its own session, the best ones first",
          "[loop_search]") {
  const std::vector<SessionData> sessions = crawled(1, 16, 1.0);
  LoopConfig config = close_config();
  const auto all = find_intra_session_candidates(sessions, config, 1);
  CHECK(most_proposed(all) == 3);
  REQUIRE(all.size() > 6);
  for (std::size_t i = 0; i < all.size(); ++i) {
    CHECK(all[i].match.session == 0);
    CHECK(all[i].query.keyframe >= all[i].match.keyframe + 3);
    if (i == 0) continue;
    CHECK(std::pair(all[i - 1].accepted, all[i - 1].confidence) >=
          std::pair(all[i].accepted, all[i].confidence));
  }
  for (const std::size_t limit : {all.size() - 1, all.size()}) {
    config.max_candidates_per_pair = static_cast<std::uint32_t>(limit);
    check_first(all, find_intra_session_candidates(sessions, config, 1), limit);
  }
}

TEST_CASE("A robot that waits does not displace the candidates of other places", "[loop_search]") {
  // Both wait for 30 keyframes at the start, where they agree best, and then drive 60 m.
  std::vector<Pose> poses(30, crawl(1, 0.0).front());
  for (const Pose& pose : crawl(16, 4.0)) poses.push_back(pose);
  const std::vector<SessionData> sessions{recorded(poses, 1), recorded(poses, 2)};
  LoopConfig config;
  const auto elsewhere = [&](const std::vector<LoopCandidate>& candidates) {
    return std::count_if(candidates.begin(), candidates.end(), [](const LoopCandidate& c) {
      return c.accepted && c.query.keyframe > 35 && c.match.keyframe > 35;
    });
  };
  const auto all = find_inter_session_candidates(sessions, config);
  config.max_candidates_per_pair = 24;
  REQUIRE(all.size() > 3 * config.max_candidates_per_pair);
  const auto chosen = find_inter_session_candidates(sessions, config);
  REQUIRE(chosen.size() == 24);
  CHECK(elsewhere(all) > 12);
  CHECK(elsewhere(chosen) >= 6);
}

TEST_CASE("Candidates of two sessions do not depend on sessions that are added", "[loop_search]") {
  std::vector<SessionData> sessions = crawled(2, 10, 2.0);
  const auto pairs_of_both = [&] {
    std::set<std::pair<KeyframeId, KeyframeId>> pairs;
    for (const LoopCandidate& loop : find_inter_session_candidates(sessions, LoopConfig{})) {
      const auto keyframes = std::minmax(loop.query, loop.match);
      if (keyframes.second.session < 2) pairs.insert(keyframes);
    }
    return pairs;
  };
  const auto alone = pairs_of_both();
  CHECK(alone.size() > 30);
  for (const std::uint64_t seed : {3U, 4U}) {
    sessions.push_back(recorded(crawl(20, 1.0), seed));
    CHECK((pairs_of_both() == alone));
  }
}

TEST_CASE("Every session has candidates of its own, however many threads look for them",
          "[loop_search]") {
  const std::vector<SessionData> sessions{recorded(crawl(10, 1.0), 1), recorded(crawl(12, 1.0), 2)};
  const auto found = find_intra_session_candidates(sessions, close_config(), 1);
  check_first(found, find_intra_session_candidates(sessions, close_config(), 2), found.size());
  std::set<std::size_t> with_loops;
  for (const LoopCandidate& loop : found) {
    with_loops.insert(loop.query.session);
    CHECK(loop.query.session == loop.match.session);
  }
  CHECK(with_loops == std::set<std::size_t>{0, 1});
}

TEST_CASE("Of the two directions of a pair of keyframes the more confident one is proposed",
          "[loop_search]") {
  std::size_t compared = 0;
  for (const double gap_m : {2.0, 4.0, 6.0, 8.0}) {
    const auto both = crawl(2, gap_m);
    const std::vector<SessionData> sessions{recorded({both[0]}, 1), recorded({both[1]}, 2)};
    const auto confidence = [&](std::size_t query) {
      const KeyframeRecord& own = sessions[query].keyframes[0];
      const KeyframeRecord& other = sessions[1 - query].keyframes[0];
      InArena<PlaceDatabase> database(base_search_config(2), PlaceShape{});
      database->insert(other.place(), {1 - query, 0}, other.T_odometry_keyframe);
      const auto found =
          database->search(own.place(), {query, 0}, {SearchScope::Sessions::kOnlyOther, 0});
      return found.empty() ? 0.0F : found[0].confidence;
    };
    const float by_first = confidence(0);
    const float by_second = confidence(1);
    if (by_first == by_second) continue;
    ++compared;
    const auto found = find_inter_session_candidates(sessions, LoopConfig{});
    REQUIRE(found.size() == 1);
    CHECK(found[0].confidence == std::max(by_first, by_second));
    CHECK(found[0].query.session == (by_first > by_second ? 0 : 1));
  }
  CHECK(compared >= 2);
}

TEST_CASE("A single session, or none with keyframes, has no candidates between sessions",
          "[loop_search]") {
  const SessionData one = crawled(1, 3, 2.0)[0];
  CHECK(find_inter_session_candidates({}, {}).empty());
  CHECK(find_inter_session_candidates({one}, {}).empty());
  CHECK(find_inter_session_candidates({SessionData{}, SessionData{}}, {}).empty());
  CHECK(find_inter_session_candidates({one, SessionData{}}, {}).empty());
  CHECK_FALSE(find_inter_session_candidates({one, one}, {}).empty());
}

TEST_CASE("Beyond fifty thousand places the search tolerates less", "[loop_search]") {
  const LoopSearchConfig usual;
  const LoopSearchConfig many = base_search_config(50'000);
  const LoopSearchConfig too_many = base_search_config(50'001);
  CHECK(many.max_places == 50'000);
  CHECK(many.side_tolerance_m == usual.side_tolerance_m);
  CHECK(many.max_code_difference == usual.max_code_difference);
  CHECK(too_many.max_places == 50'001);
  CHECK(too_many.side_tolerance_m < usual.side_tolerance_m);
  CHECK(too_many.max_code_difference < usual.max_code_difference);
}

TEST_CASE("Keyframes within the radius are proposed, with the pose between them",
          "[radius_search]") {
  const MergeConfig config;
  for (const double distance : {config.radius.radius_m - 0.1, config.radius.radius_m + 0.1}) {
    Aligned maps;
    maps.add(0, at(0.0, 0.0, 0.4));
    maps.add(1, at(distance, 0.0, 0.1));
    const auto found = maps.search(config);
    REQUIRE(found.size() == (distance < config.radius.radius_m ? 1 : 0));
    if (found.empty()) continue;
    CHECK(found[0].query.session == 1);
    CHECK(found[0].match.session == 0);
    const Pose expected = at(0.0, 0.0, 0.4).inverse() * at(distance, 0.0, 0.1);
    CHECK(apart_m(found[0].T_match_query, expected) < 1e-9);
  }
}

TEST_CASE("Two narrow sensors must look the same way, beside a wide one it does not matter",
          "[radius_search]") {
  constexpr double kHalfFovRad = 0.5 * 70.4 * 3.14159265358979 / 180.0;
  const auto found = [](const char* match_sensor, double turn) {
    Aligned maps;
    maps.sessions[0].info.sensor = match_sensor;
    maps.sessions[1].info.sensor = "livox-avia";
    maps.add(0, at(0.0, 0.0));
    maps.add(1, at(2.0, 0.0, turn));
    return maps.search().size();
  };
  CHECK(found("livox-avia", kHalfFovRad - 0.02) == 1);
  CHECK(found("livox-avia", kHalfFovRad + 0.02) == 0);
  CHECK(found("os2-128", kHalfFovRad + 0.02) == 1);
  CHECK(found("os2-128", 3.1) == 1);
}

TEST_CASE("The nearest keyframes are proposed, spaced along the query's path", "[radius_search]") {
  Aligned maps;
  for (int i = 0; i < 41; ++i) {
    maps.add(0, at(1.0 * i, 1.0));
    maps.add(1, at(1.0 * i, 0.0));
  }
  MergeConfig config;
  config.loops.min_path_gap_m = 1000.0;  // no loops within a session
  auto found = maps.search(config);
  REQUIRE(found.size() == 11);
  for (std::size_t i = 0; i < found.size(); ++i) {
    CHECK(found[i].query.keyframe == 4 * i);
    CHECK(found[i].match.keyframe == 4 * i);
  }
  // What is known already is not proposed again, nor the next nearest in its stead.
  std::vector<LoopConstraint> known(1);
  known[0].query = {0, 8};
  known[0].match = {1, 8};
  for (const bool from_the_other_side : {false, true}) {
    if (from_the_other_side) std::swap(known[0].query, known[0].match);
    found = maps.search(config, known);
    for (const LoopCandidate& loop : found) CHECK(loop.match.keyframe == loop.query.keyframe);
    CHECK(found.size() == 10);  // from keyframe 9 on instead
    CHECK(found[2].query.keyframe == 9);
  }
}

TEST_CASE("Within a session both gaps count, by keyframes and along the path", "[radius_search]") {
  // Out 30 m and back on the other side of the street.
  Aligned maps;
  for (int i = 0; i <= 15; ++i) maps.add(0, at(2.0 * i, 0.0));
  for (int i = 15; i >= 0; --i) maps.add(0, at(2.0 * i, 2.0));
  MergeConfig config;
  config.radius.radius_m = 2.5;
  const auto least_gap = [&](std::uint32_t keyframes, double path_m) {
    config.loops.min_keyframe_gap = keyframes;
    config.loops.min_path_gap_m = path_m;
    std::size_t least = 1000;
    for (const LoopCandidate& loop : maps.search(config)) {
      const std::size_t gap = loop.query.keyframe - loop.match.keyframe;
      least = std::min(least, gap);
    }
    return least;
  };
  CHECK(least_gap(11, 0.0) == 11);
  CHECK(least_gap(1, 25.9) == 13);  // 26 m
}

TEST_CASE("A keyframe that enough sessions hold by loops is searched for in no further one",
          "[radius_search]") {
  constexpr std::size_t kLast = kSessionsPerKeyframe + 1;
  Aligned maps;
  maps.sessions.resize(kLast + 1);
  std::vector<LoopConstraint> known;
  for (std::size_t s = 0; s <= kLast; ++s) {
    maps.add(s, at(0.5 * static_cast<double>(s), 0.0));
    if (s == 0 || s == kLast) continue;
    known.emplace_back();
    known.back().query = {s, 0};
    known.back().match = {kLast, 0};
  }
  const auto pairs_of_last = [&] {
    const auto found = maps.search({}, known);
    return std::count_if(found.begin(), found.end(), [](const LoopCandidate& candidate) {
      return candidate.query.session == kLast;
    });
  };
  CHECK(pairs_of_last() == 0);
  known.pop_back();
  CHECK(pairs_of_last() == 2);  // in sessions 0 and kLast - 1
}

TEST_CASE("Sessions that are not connected are not searched", "[radius_search]") {
  Aligned maps;
  maps.add(0, at(0.0, 0.0));
  maps.add(1, at(1.0, 0.0));
  CHECK(maps.search().size() == 1);
  maps.unconnected = 0;
  CHECK(maps.search().empty());
}
