// Tests of the order in which loop candidates between sessions are verified.
#include "src/merge/loops/verification_rounds.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

LoopCandidate between(KeyframeId query, KeyframeId match) {
  LoopCandidate candidate;
  candidate.query = query;
  candidate.match = match;
  return candidate;
}

/// Verifies candidates by a rule, and counts them.
struct Verifier {
  std::function<bool(const LoopCandidate&)> fits = [](const auto&) { return true; };
  std::vector<std::size_t> rounds;  ///< sizes
  std::vector<LoopConstraint> operator()(std::span<const LoopCandidate> candidates) {
    rounds.push_back(candidates.size());
    std::vector<LoopConstraint> loops;
    for (const LoopCandidate& candidate : candidates) {
      LoopConstraint& loop = loops.emplace_back();
      loop.query = candidate.query;
      loop.match = candidate.match;
      loop.decision.accepted = fits(candidate);
    }
    return loops;
  }
};

std::vector<LoopConstraint> verified(const std::vector<LoopCandidate>& candidates,
                                     std::uint32_t enough, Verifier& verifier) {
  return verify_in_rounds(candidates, enough, std::ref(verifier));
}

/// Sessions of the matches of keyframe 0.
std::set<std::size_t> matches_of_first(const std::vector<LoopConstraint>& loops) {
  std::set<std::size_t> sessions;
  for (const LoopConstraint& loop : loops) {
    if (loop.query.keyframe == 0) sessions.insert(loop.match.session);
  }
  return sessions;
}

/// One keyframe of session 5 with a candidate in each of five earlier sessions; its session has
/// most candidates with session 3, then with session 1.
std::vector<LoopCandidate> six_sessions() {
  std::vector<LoopCandidate> candidates;
  for (std::size_t s = 0; s < 5; ++s) candidates.push_back(between({5, 0}, {s, 0}));
  for (std::size_t k = 1; k < 4; ++k) candidates.push_back(between({5, k}, {3, k}));
  for (std::size_t k = 1; k < 3; ++k) candidates.push_back(between({5, k}, {1, k}));
  return candidates;
}

}  // namespace

TEST_CASE("a keyframe is verified against so many sessions, those with most candidates first",
          "[rounds]") {
  Verifier verifier;
  const auto loops = verified(six_sessions(), 2, verifier);
  CHECK(matches_of_first(loops) == std::set<std::size_t>{1, 3});
  CHECK(verifier.rounds == std::vector<std::size_t>{7});
}

TEST_CASE("where a session does not hold a keyframe the next one is tried", "[rounds]") {
  Verifier verifier;
  verifier.fits = [](const LoopCandidate& candidate) { return candidate.match.session != 3; };
  const auto loops = verified(six_sessions(), 2, verifier);
  CHECK(matches_of_first(loops) == std::set<std::size_t>{0, 1, 3});
  CHECK(verifier.rounds == std::vector<std::size_t>{7, 1});
}

TEST_CASE("a keyframe that nothing holds is verified against all sessions, if there are any",
          "[rounds]") {
  Verifier verifier;
  verifier.fits = [](const auto&) { return false; };
  CHECK(verified({}, 2, verifier).empty());
  CHECK(verifier.rounds.empty());
  CHECK(verified(six_sessions(), 1, verifier).size() == six_sessions().size());
}

TEST_CASE("as many sessions as are enough are verified in one round, in the candidates' order",
          "[rounds]") {
  Verifier verifier;
  auto candidates = six_sessions();
  std::reverse(candidates.begin(), candidates.end());
  candidates.push_back(between({1, 7}, {5, 3}));  // searched for the other way around
  const auto loops = verified(candidates, 5, verifier);
  REQUIRE(loops.size() == candidates.size());
  for (std::size_t i = 0; i < loops.size(); ++i) {
    CHECK(loops[i].query == candidates[i].query);
    CHECK(loops[i].match == candidates[i].match);
  }
  CHECK(verifier.rounds.size() == 1);
}

TEST_CASE("a session that is added later leaves the choice among the earlier ones", "[rounds]") {
  auto candidates = six_sessions();
  Verifier verifier;
  const std::size_t before = verified(candidates, 2, verifier).size();
  // Session 6 has candidates everywhere.
  for (std::size_t s = 0; s < 6; ++s) {
    for (std::size_t k = 0; k < 8; ++k) candidates.push_back(between({s, k}, {6, k}));
  }
  const auto loops = verified(candidates, 2, verifier);
  const auto among_earlier = std::count_if(
      loops.begin(), loops.end(), [](const auto& loop) { return loop.match.session != 6; });
  CHECK(static_cast<std::size_t>(among_earlier) == before);
  CHECK(loops.size() == before + 2 * 8);
}
