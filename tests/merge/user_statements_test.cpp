// Tests of merges that obey people and remember verified loops.
#include "unimapper/merge/user_statements.hpp"

#include "tests/merge/exported_files.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/merge/poses.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

namespace {

/// Two robots in the same streets.
const std::vector<SessionData>& robots() {
  static const std::vector<SessionData> shared{map_of_town().drive.session, friday().session};
  return shared;
}

MergeResult merge_with(const UserStatements& statements, LoopOutcomes* outcomes = nullptr) {
  return merge_sessions(robots(), {}, {}, statements, outcomes);
}

const MergeResult& without_statements() {
  static const MergeResult shared = merge_with({});
  return shared;
}

std::map<std::string, std::string> exported(const MergeResult& result,
                                            const std::vector<SessionData>& sessions = robots()) {
  const TemporaryDirectory folder;
  export_map(folder.path(), sessions, result);
  return exported_files(folder.path());
}

bool is_apart(const MergeResult& result, std::size_t session = 1) {
  return result.sessions[session].status == SessionStatus::kUnconnected;
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

/// Statements under which no loop between the sessions is found, or this one alone.
UserStatements all_forbidden(const std::optional<KeyframePair>& but = std::nullopt) {
  UserStatements statements;
  for (std::uint32_t a = 0; a < robots()[0].keyframes.size(); ++a) {
    for (std::uint32_t b = 0; b < robots()[1].keyframes.size(); ++b) {
      const KeyframePair pair{KeyframeId{0, a}, KeyframeId{1, b}};
      if (but && std::minmax(but->a, but->b) == std::minmax(pair.a, pair.b)) continue;
      statements.forbidden.push_back(pair);
    }
  }
  return statements;
}

/// Outcomes in memory, with how often they were asked for.
struct Memory final : LoopOutcomes {
  using Key = std::tuple<KeyframeId, KeyframeId, std::vector<double>, std::uint64_t>;
  std::map<Key, LoopConstraint> known;
  std::size_t found = 0;
  std::size_t kept = 0;
  using PlacementKey = std::tuple<std::uint32_t, std::uint32_t, std::uint64_t>;
  std::map<PlacementKey, PlacementEvidence> placements;
  std::size_t placements_found = 0;

  static Key key_of(const LoopQuestion& question) {
    const Pose& T = question.T_match_query;
    std::vector<double> numbers(T.rotation.data(), T.rotation.data() + 9);
    numbers.insert(numbers.end(), T.translation.data(), T.translation.data() + 3);
    return {question.query, question.match, numbers, question.fingerprint};
  }
  template <typename Outcomes, typename Question>
  static auto look_up(const Outcomes& outcomes, const Question& question, std::size_t& times) {
    const auto entry = outcomes.find(key_of(question));
    if (entry == outcomes.end()) return std::optional<typename Outcomes::mapped_type>();
    ++times;
    return std::optional(entry->second);
  }
  std::optional<LoopConstraint> find(const LoopQuestion& question) override {
    return look_up(known, question, found);
  }
  void keep(std::span<const Entry> entries) override {
    kept += entries.size();
    for (const Entry& entry : entries) known.emplace(key_of(entry.question), entry.outcome);
  }

  static PlacementKey key_of(const PlacementQuestion& question) {
    return {question.query, question.match, question.fingerprint};
  }
  std::optional<PlacementEvidence> find(const PlacementQuestion& question) override {
    return look_up(placements, question, placements_found);
  }
  void keep(const PlacementQuestion& question, const PlacementEvidence& evidence) override {
    placements.emplace(key_of(question), evidence);
  }
};

}  // namespace

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
    CHECK(is_apart(result, session));
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
  CHECK(is_apart(merge_with(all_forbidden())));
  UserStatements statements = all_forbidden(KeyframePair{loop.query, loop.match});
  SECTION("at a pose") { statements.links.push_back({loop.query, loop.match, loop.T_match_query}); }
  SECTION("without a pose") { statements.links.push_back({loop.query, loop.match, std::nullopt}); }
  const MergeResult result = merge_with(statements);
  REQUIRE_FALSE(is_apart(result, 0));
  REQUIRE_FALSE(is_apart(result, 1));
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
  const KeyframeId query{0, 0};
  const KeyframeId match{1, 0};  // far apart, without anything in common
  UserStatements statements = all_forbidden(KeyframePair{query, match});
  statements.links.push_back({query, match, shifted(0.0, -500.0)});
  const MergeResult result = merge_with(statements);
  CHECK_FALSE(is_apart(result));
  const Pose T_match_query =
      result.sessions[1].T_map_keyframe[0].inverse() * result.sessions[0].T_map_keyframe[0];
  CHECK(apart_m(T_match_query, shifted(0.0, -500.0)) < 0.5);

  statements.links.front().T_match_query.reset();
  const MergeResult refused = merge_with(statements);
  CHECK(is_apart(refused));
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
  Memory memory;
  const MergeResult first = merge_with({}, &memory);
  CHECK(exported(first) == exported(without_statements()));
  CHECK(memory.kept > 0);
  const std::size_t kept = memory.kept;
  CHECK(exported(merge_with({}, &memory)) == exported(first));
  CHECK(memory.kept == kept);
  CHECK(memory.found == kept);

  // Parameters that verification does not see.
  MergeConfig config;
  config.acceptance.margin = 1.5;
  config.map.voxel_size_m = 0.4F;
  (void)merge_sessions(robots(), config, {}, {}, &memory);
  CHECK(memory.kept == kept);
  // Parameters that it sees.
  config.loops.min_overlap = 0.46;
  const MergeResult other = merge_sessions(robots(), config, {}, {}, &memory);
  CHECK(memory.kept > kept);
  CHECK(exported(other) == exported(merge_sessions(robots(), config)));

  // A keyframe whose content is another one.
  const std::size_t before = memory.kept;
  std::vector<SessionData> changed = robots();
  for (KeyframeRecord& keyframe : changed[0].keyframes) keyframe.static_cells.pop_back();
  const MergeResult of_changed = merge_sessions(changed, {}, {}, {}, &memory);
  CHECK(memory.kept > before);
  CHECK(exported(of_changed, changed) == exported(merge_sessions(changed), changed));
}

TEST_CASE("a merge that knows the evidence about a placement checks it once",
          "[statements][slow]") {
  const auto poses_with = [](Memory& memory, const MergeConfig& config = {}) {
    return merge_poses(robots(), config, {}, {}, &memory);
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
  std::vector<SessionData> changed = robots();
  changed[1].keyframes.front().static_cells.pop_back();
  CHECK(merge_poses(changed, {}, {}, {}, &memory).pairs[0].state == PairState::kConfirmed);
  CHECK(memory.placements.size() == 3);
}

TEST_CASE("a merge is completed from its poses and loops to the same bytes", "[statements][slow]") {
  MergeResult posed = merge_poses(robots());
  CHECK(posed.map.empty());
  CHECK(posed.loops.size() == without_statements().loops.size());
  CHECK(exported(complete_merge(robots(), posed)) == exported(without_statements()));
  posed.sessions[0].T_map_keyframe.pop_back();
  CHECK_THROWS_WITH(complete_merge(robots(), posed), Contains("of other sessions"));
}
