// Tests of merges that obey people and remember verified loops.
#include "unimapper/merge/user_statements.hpp"

#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>
#include <map>
#include <tuple>

#include "tests/merge/synthetic_town.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using Catch::Matchers::Contains;
using unimapper::merge::testing::Drive;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;

namespace {

namespace fs = std::filesystem;

/// Two robots in the same streets.
struct Robots {
  std::vector<Drive> drives;
  std::vector<SessionData> sessions;

  Robots() {
    const auto town = make_town(1, 2);
    drives.push_back(record(town, drive_roads({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}), "a", 11));
    drives.push_back(record(town, drive_roads({{2, 1}, {0, 1}, {0, 0}}), "b", 12));
    for (const Drive& drive : drives) sessions.push_back(drive.session);
  }
};

const Robots& robots() {
  static const Robots shared;
  return shared;
}

MergeResult merge_with(const UserStatements& statements, LoopOutcomes* outcomes = nullptr) {
  return merge_sessions(robots().sessions, {}, {}, statements, outcomes);
}

const MergeResult& without_statements() {
  static const MergeResult shared = merge_with({});
  return shared;
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every exported file but the durations.
std::map<std::string, std::string> exported(const std::vector<SessionData>& sessions,
                                            const MergeResult& result) {
  const TemporaryDirectory folder;
  export_map(folder.path(), sessions, result);
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
    files[entry.path().lexically_relative(folder.path()).string()] = text_of(entry.path());
  }
  return files;
}

const LoopConstraint* find_loop(const MergeResult& result, KeyframeId query, KeyframeId match) {
  for (const LoopConstraint& loop : result.loops) {
    if (std::minmax(loop.query, loop.match) == std::minmax(query, match)) return &loop;
  }
  return nullptr;
}

/// The accepted loop between sessions that overlaps most.
const LoopConstraint& best_loop(const MergeResult& result) {
  const LoopConstraint* best = nullptr;
  for (const LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted || loop.is_intra_session()) continue;
    if (best == nullptr || loop.overlap > best->overlap) best = &loop;
  }
  REQUIRE(best != nullptr);
  return *best;
}

/// Statements under which no loop between the sessions is found but those that people link.
UserStatements all_forbidden() {
  UserStatements statements;
  for (std::uint32_t q = 0; q < robots().sessions[0].keyframes.size(); ++q) {
    for (std::uint32_t m = 0; m < robots().sessions[1].keyframes.size(); ++m) {
      statements.forbidden.push_back({KeyframeId{0, q}, KeyframeId{1, m}});
    }
  }
  return statements;
}

void allow(UserStatements& statements, KeyframeId query, KeyframeId match) {
  std::erase_if(statements.forbidden, [&](const KeyframePair& pair) {
    return std::minmax(pair.a, pair.b) == std::minmax(query, match);
  });
}

/// Outcomes in memory, with how often they were asked for.
struct Memory final : LoopOutcomes {
  using Key = std::tuple<KeyframeId, KeyframeId, std::vector<std::uint64_t>, std::uint64_t>;
  std::map<Key, LoopConstraint> known;
  std::size_t found = 0;
  std::size_t kept = 0;
  using PlacementKey = std::tuple<std::uint32_t, std::uint32_t, std::uint64_t>;
  std::map<PlacementKey, PlacementEvidence> placements;
  std::size_t placements_found = 0;

  static Key key_of(const LoopQuestion& question) {
    std::vector<std::uint64_t> bits;
    for (int i = 0; i < 9; ++i) {
      bits.push_back(std::bit_cast<std::uint64_t>(question.T_match_query.rotation.data()[i]));
    }
    for (int i = 0; i < 3; ++i) {
      bits.push_back(std::bit_cast<std::uint64_t>(question.T_match_query.translation[i]));
    }
    return {question.query, question.match, bits, question.fingerprint};
  }
  std::optional<LoopConstraint> find(const LoopQuestion& question) override {
    const auto entry = known.find(key_of(question));
    if (entry == known.end()) return std::nullopt;
    ++found;
    return entry->second;
  }
  void keep(std::span<const Entry> entries) override {
    for (const Entry& entry : entries) {
      ++kept;
      known.emplace(key_of(entry.question), entry.outcome);
    }
  }

  static PlacementKey key_of(const PlacementQuestion& question) {
    return {question.query, question.match, question.fingerprint};
  }
  std::optional<PlacementEvidence> find(const PlacementQuestion& question) override {
    const auto entry = placements.find(key_of(question));
    if (entry == placements.end()) return std::nullopt;
    ++placements_found;
    return entry->second;
  }
  void keep(const PlacementQuestion& question, const PlacementEvidence& evidence) override {
    placements.emplace(key_of(question), evidence);
  }
};

}  // namespace

TEST_CASE("two robots in the same streets are merged without statements", "[statements][slow]") {
  CHECK(without_statements().sessions[1].status != SessionStatus::kUnconnected);
}

TEST_CASE("a loop that a person forbids is never accepted", "[statements][slow]") {
  const LoopConstraint& loop = best_loop(without_statements());
  UserStatements statements;
  statements.forbidden.push_back({loop.match, loop.query});
  const MergeResult result = merge_with(statements);
  for (const LoopConstraint& other : result.loops) {
    if (std::minmax(other.query, other.match) != std::minmax(loop.query, loop.match)) continue;
    CHECK_FALSE(other.decision.accepted);
    CHECK(other.decision.reason == "forbidden by a person");
  }
  CHECK(find_loop(result, loop.query, loop.match) != nullptr);
}

TEST_CASE("a session that a person keeps apart stays apart, whichever it is",
          "[statements][slow]") {
  for (const std::uint32_t session : {0U, 1U}) {
    UserStatements statements;
    statements.apart.push_back(session);
    const MergeResult result = merge_with(statements);
    CHECK(result.sessions[session].status == SessionStatus::kUnconnected);
    CHECK(result.sessions[session].reason == "kept apart by a person");
    CHECK(result.central_session == 1 - session);
    for (const LoopConstraint& loop : result.loops) {
      if (loop.is_intra_session()) continue;
      CHECK(loop.decision.reason == "kept apart by a person");
    }
  }
}

TEST_CASE("the session that a person names is the central one", "[statements][slow]") {
  for (const std::uint32_t session : {0U, 1U}) {
    UserStatements statements;
    statements.reference = session;
    const MergeResult result = merge_with(statements);
    CHECK(result.central_session == session);
    CHECK(result.sessions[session].status == SessionStatus::kCentral);
    CHECK(result.sessions[1 - session].status == SessionStatus::kMerged);
  }
}

TEST_CASE("a link connects two maps although rules ask for more loops", "[statements][slow]") {
  const LoopConstraint loop = best_loop(without_statements());
  UserStatements statements = all_forbidden();
  CHECK(merge_with(statements).sessions[1].status == SessionStatus::kUnconnected);
  allow(statements, loop.query, loop.match);
  SECTION("at a pose") { statements.links.push_back({loop.query, loop.match, loop.T_match_query}); }
  SECTION("without a pose") { statements.links.push_back({loop.query, loop.match, std::nullopt}); }
  const MergeResult result = merge_with(statements);
  REQUIRE(result.sessions[0].status != SessionStatus::kUnconnected);
  REQUIRE(result.sessions[1].status != SessionStatus::kUnconnected);
  const auto linked = std::find_if(result.loops.begin(), result.loops.end(),
                                   [](const LoopConstraint& other) { return other.by_person; });
  REQUIRE(linked != result.loops.end());
  CHECK(linked->decision.accepted);
  CHECK(linked->decision.reason == "linked by a person");
  // As the merge of all loops has it, within what one loop can tell.
  const auto relative = [](const MergeResult& of) {
    return of.sessions[0].T_map_session.inverse() * of.sessions[1].T_map_session;
  };
  const Pose difference = relative(without_statements()).inverse() * relative(result);
  CHECK(difference.translation.norm() < 2.0);
}

TEST_CASE("a link at a pose that nothing confirms is taken as it is said", "[statements][slow]") {
  UserStatements statements = all_forbidden();
  const KeyframeId query{0, 0};
  const KeyframeId match{1, 0};  // far apart, without anything in common
  allow(statements, query, match);
  statements.links.push_back({query, match, Pose(Eigen::Matrix3d::Identity(), {0, -500, 0})});
  const MergeResult result = merge_with(statements);
  CHECK(result.sessions[1].status != SessionStatus::kUnconnected);
  const Pose T_match_query =
      result.sessions[1].T_map_keyframe[0].inverse() * result.sessions[0].T_map_keyframe[0];
  CHECK((T_match_query.translation - Eigen::Vector3d(0, -500, 0)).norm() < 0.5);

  statements.links.front().T_match_query.reset();
  const MergeResult refused = merge_with(statements);
  CHECK(refused.sessions[1].status == SessionStatus::kUnconnected);
  const LoopConstraint* loop = find_loop(refused, query, match);
  REQUIRE(loop != nullptr);
  CHECK_THAT(loop->decision.reason, Contains("no registration confirms it"));
}

TEST_CASE("statements about what is not there, and contradictions, are refused", "[statements]") {
  const auto refused = [](const UserStatements& statements, const char* why) {
    CHECK_THROWS_WITH(merge_with(statements), Contains(why));
  };
  UserStatements statements;
  statements.apart = {2};
  refused(statements, "session that is not there");
  statements.apart = {0};
  statements.reference = 0;
  refused(statements, "the reference session is kept apart");
  statements.reference.reset();
  statements.links.push_back({KeyframeId{0, 0}, KeyframeId{1, 0}, std::nullopt});
  refused(statements, "contradicts");
  statements.apart.clear();
  statements.links.front().match = KeyframeId{1, 1000};
  refused(statements, "keyframe that is not there");
  statements.links.front().match = statements.links.front().query;
  refused(statements, "linked to itself");
}

TEST_CASE("a merge that knows loops verifies new ones only and has the same result",
          "[statements][slow]") {
  const std::vector<SessionData>& sessions = robots().sessions;
  Memory memory;
  const MergeResult first = merge_with({}, &memory);
  CHECK(exported(sessions, first) == exported(sessions, without_statements()));
  CHECK(memory.kept > 0);
  const std::size_t kept = memory.kept;
  const MergeResult second = merge_with({}, &memory);
  CHECK(exported(sessions, second) == exported(sessions, first));
  CHECK(memory.kept == kept);
  CHECK(memory.found == kept);

  // Parameters that verification does not see.
  MergeConfig config;
  config.acceptance.margin = 1.5;
  config.map.voxel_size_m = 0.4F;
  const MergeResult same = merge_sessions(sessions, config, {}, {}, &memory);
  CHECK(memory.kept == kept);
  // Parameters that it sees.
  config.loops.min_overlap = 0.46;
  const MergeResult other = merge_sessions(sessions, config, {}, {}, &memory);
  CHECK(memory.kept > kept);
  CHECK(exported(sessions, other) == exported(sessions, merge_sessions(sessions, config)));

  // A keyframe whose content is another one.
  const std::size_t before = memory.kept;
  std::vector<SessionData> changed = sessions;
  for (KeyframeRecord& keyframe : changed[0].keyframes) keyframe.static_cells.pop_back();
  const MergeResult of_changed = merge_sessions(changed, {}, {}, {}, &memory);
  CHECK(memory.kept > before);
  CHECK(exported(changed, of_changed) == exported(changed, merge_sessions(changed)));
}

TEST_CASE("a merge that knows the evidence about a placement checks it once",
          "[statements][slow]") {
  const auto poses_with = [](Memory& memory, const MergeConfig& config = {}) {
    return merge_poses(robots().sessions, config, {}, {}, &memory);
  };
  Memory memory;
  const MergeResult first = poses_with(memory);
  CHECK(memory.placements.size() == 1);
  CHECK(memory.placements_found == 0);
  const MergeResult second = poses_with(memory);
  CHECK(memory.placements.size() == 1);
  CHECK(memory.placements_found == 1);
  CHECK(second.pairs[0].state == PairState::kConfirmed);
  CHECK(second.sessions[1].T_map_session.translation ==
        first.sessions[1].T_map_session.translation);

  // Parameters that the check sees and verification does not.
  const std::size_t kept = memory.kept;
  MergeConfig config;
  config.aliasing.alike_share += 0.001;
  (void)poses_with(memory, config);
  CHECK(memory.placements.size() == 2);
  CHECK(memory.kept == kept);

  // What is kept decides: aliasing leaves the pair waiting.
  for (auto& [question, evidence] : memory.placements) evidence.aliasing = "it repeats";
  CHECK(poses_with(memory).pairs[0].state == PairState::kProvisional);

  // A keyframe far from where the sessions meet, if they meet anywhere.
  std::vector<SessionData> changed = robots().sessions;
  changed[1].keyframes.front().static_cells.pop_back();
  CHECK(merge_poses(changed, {}, {}, {}, &memory).pairs[0].state == PairState::kConfirmed);
  CHECK(memory.placements.size() == 3);
}

TEST_CASE("a merge is completed from its poses and loops to the same bytes", "[statements][slow]") {
  const MergeResult& whole = without_statements();
  const std::vector<SessionData>& sessions = robots().sessions;
  MergeResult posed = merge_poses(sessions);
  CHECK(posed.map.empty());
  CHECK(posed.loops.size() == whole.loops.size());
  CHECK(exported(sessions, complete_merge(sessions, posed)) == exported(sessions, whole));
  posed.sessions[0].T_map_keyframe.pop_back();
  CHECK_THROWS_WITH(complete_merge(sessions, posed), Contains("of other sessions"));
}
