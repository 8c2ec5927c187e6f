// Random merger configurations: refusal with a message, or a merge.
#include "tests/merge/synthetic_town.hpp"
#include "tests/random_parameters.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// A short street seen by two robots, with every `kThinning`-th cell of their keyframes, some of
/// them labelled dynamic.
std::vector<SessionData> two_sessions() {
  constexpr std::size_t kThinning = 20;
  const std::vector<Drive> drives = same_way({{0, 0}, {0.6, 0}});
  std::vector<SessionData> sessions{drives[0].session, drives[1].session};
  for (SessionData& session : sessions) {
    for (KeyframeRecord& keyframe : session.keyframes) {
      std::vector<FineCell> kept;
      for (std::size_t i = 0; i < keyframe.static_cells.size(); i += kThinning) {
        const FineCell& cell = keyframe.static_cells[i];
        (i % 60 == 0 && cell.ground == 0 ? keyframe.dynamic_cells : kept).push_back(cell);
      }
      keyframe.static_cells = std::move(kept);
    }
  }
  return sessions;
}

void check(const std::vector<SessionData>& sessions, const MergeResult& result) {
  REQUIRE(result.sessions.size() == sessions.size());
  REQUIRE(result.sessions.at(result.central_session).status == SessionStatus::kCentral);
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const MergedSession& merged = result.sessions[s];
    REQUIRE(merged.reason.empty() == is_in_map(merged.status));
    REQUIRE(merged.T_map_session.is_rigid());
    REQUIRE(merged.T_map_keyframe.size() == sessions[s].keyframes.size());
    REQUIRE(std::all_of(merged.T_map_keyframe.begin(), merged.T_map_keyframe.end(),
                        [](const Pose& pose) { return pose.is_rigid(); }));
  }
  for (const LoopConstraint& loop : result.loops) {
    REQUIRE_FALSE(loop.decision.reason.empty());
    REQUIRE(loop.T_match_query.is_rigid());
    REQUIRE(loop.information.allFinite());
    REQUIRE(std::isfinite(loop.confidence));
  }
  REQUIRE(std::all_of(result.map.begin(), result.map.end(), [&](const MapPoint& point) {
    return point.position.allFinite() && point.session < sessions.size() &&
           point.sessions_seen >= 1 && point.sessions_seen <= sessions.size();
  }));
  REQUIRE(std::all_of(result.changes.begin(), result.changes.end(),
                      [](const ChangedPoint& point) { return point.position.allFinite(); }));
  REQUIRE(std::all_of(result.dynamic_points.begin(), result.dynamic_points.end(),
                      [](const Eigen::Vector3f& point) { return point.allFinite(); }));
  REQUIRE_FALSE((result.map.empty() && result.dynamic_points.empty()));
}

struct Outcomes {
  std::size_t refused = 0;
  std::size_t connected = 0;
  std::size_t apart = 0;
};

Outcomes merge_with_random_configurations(std::size_t runs) {
  const std::vector<SessionData> sessions = two_sessions();
  test::RandomParameters random(20261122);
  Outcomes outcomes;
  for (std::size_t i = 0; i < runs; ++i) {
    CAPTURE(i);
    MergeConfig config;
    random.change_some(kCheckedParameters<MergeConfig>, &config);
    const Error error = config.validate();
    if (error.code != ErrorCode::kOk) {
      ++outcomes.refused;
      REQUIRE(error.code == ErrorCode::kInvalidConfig);
      REQUIRE(test::names_a_parameter(kCheckedParameters<MergeConfig>, error.message));
      REQUIRE_THROWS_WITH(merge_sessions(sessions, config), error.message);
      continue;
    }
    const MergeResult result = merge_sessions(sessions, config);
    check(sessions, result);
    const bool together = is_in_map(result.sessions[1 - result.central_session].status);
    ++(together ? outcomes.connected : outcomes.apart);
  }
  return outcomes;
}

}  // namespace

TEST_CASE("a random merger configuration is refused in words or merges two short sessions",
          "[random_config]") {
  const Outcomes few = merge_with_random_configurations(20);
  CHECK(few.refused > 4);
  CHECK(few.connected > 4);
}

TEST_CASE("of many random merger configurations some keep two short sessions apart",
          "[random_config][slow]") {
  const Outcomes many = merge_with_random_configurations(100);
  CHECK(many.refused > 20);
  CHECK(many.connected > 20);
  CHECK(many.apart > 0);
}
