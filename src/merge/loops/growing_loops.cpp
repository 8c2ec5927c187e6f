#include "growing_loops.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <tuple>

#include "loop_search.hpp"
#include "person_links.hpp"
#include "searched_loops.hpp"
#include "src/merge/placements/known_placements.hpp"
#include "src/merge/sessions/keyframe_summaries.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "verification_rounds.hpp"

namespace unimapper::merge {
namespace {

// A refusal holds for proposals as near to the one that was refused.
constexpr double kSameProposalM = 0.5;
constexpr double kSameProposalRad = 0.05;

bool is_near(const Pose& a, const Pose& b, double translation_m, double rotation_rad) {
  return (a.translation - b.translation).norm() <= translation_m &&
         rotation_angle(a.rotation.transpose() * b.rotation) <= rotation_rad;
}

}  // namespace

/// What earlier merges verified, and a few candidates more.
class GrowingLoops::UnderBudget final : public LoopSource {
 public:
  UnderBudget(GrowingLoops& loops, const GrowthBudget& budget, const UserStatements& statements,
              LoopOutcomes* outcomes)
      : loops_(loops),
        budget_(budget),
        statements_(statements),
        known_(loops.config_, statements, loops.fingerprints_, outcomes),
        placements_({loops.sessions_, loops.clouds_, loops.config_}, loops.fingerprints_,
                    outcomes) {
    loops_.placements_.begin(budget.placements, !loops_.has_grown_);
  }

  std::vector<LoopConstraint> within_sessions() override {
    verify_some();
    return known(true);
  }
  std::vector<LoopConstraint> between_sessions() override { return known(false); }
  std::vector<LoopConstraint> links() override {
    return link_loops(statements_.links, known_, loops_.clouds_);
  }
  PlacementEvidence evaluate(const Placement& placement) override {
    return loops_.placements_.evaluate(placement, placements_);
  }

  std::vector<LoopConstraint> near_each_other(
      const std::vector<LoopCandidate>& candidates) override {
    std::vector<LoopConstraint> loops;
    std::vector<LoopCandidate> chosen;
    for (const LoopCandidate& candidate : candidates) {
      if (const LoopConstraint* outcome = outcome_of(candidate)) {
        loops.push_back(loops_.at_index(*outcome));
      } else if (chosen.size() < budget_.by_pose && has_whole_cloud(candidate)) {
        chosen.push_back(candidate);
      }
    }
    std::vector<LoopConstraint> verified = known_.verify(chosen, kRadiusLimit, loops_.clouds_);
    for (std::size_t i = 0; i < verified.size(); ++i) {
      LoopConstraint outcome = verified[i];
      outcome.query = loops_.by_sequence(outcome.query);
      outcome.match = loops_.by_sequence(outcome.match);
      const std::pair key(outcome.query, outcome.match);
      loops_.near_[key] = {chosen[i].T_match_query, std::move(outcome)};
      loops.push_back(std::move(verified[i]));
    }
    return loops;
  }

 private:
  void verify_some() {
    std::vector<Pair> chosen = loops_.waiting();
    const std::uint32_t most =
        loops_.placements_.is_renewing() ? budget_.beside_check : budget_.by_descriptor;
    if (chosen.size() > most) chosen.resize(most);
    std::vector<LoopCandidate> candidates;
    candidates.reserve(chosen.size());
    for (const Pair& pair : chosen) {
      candidates.push_back(loops_.at_index(loops_.found_.at(pair).candidate));
    }
    std::vector<LoopConstraint> verified =
        known_.verify(candidates, kDescriptorLimit, loops_.clouds_);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      Found& found = loops_.found_.at(chosen[i]);
      verified[i].query = found.candidate.query;
      verified[i].match = found.candidate.match;
      found.outcome = std::move(verified[i]);
    }
  }

  [[nodiscard]] std::vector<LoopConstraint> known(bool is_within) const {
    std::vector<LoopConstraint> loops;
    for (const auto& [pair, found] : loops_.found_) {
      if (!found.outcome || (pair.first.session == pair.second.session) != is_within) continue;
      loops.push_back(loops_.at_index(*found.outcome));
      if (const char* reason = known_.refusal(loops.back().query, loops.back().match)) {
        loops.back().decision = {false, reason};
      }
    }
    return loops;
  }

  /// Of an earlier proposal, where it holds for this one.
  [[nodiscard]] const LoopConstraint* outcome_of(const LoopCandidate& candidate) const {
    const auto near = loops_.near_.find(
        {loops_.by_sequence(candidate.query), loops_.by_sequence(candidate.match)});
    if (near == loops_.near_.end()) return nullptr;
    const LoopConstraint& outcome = near->second.outcome;
    const bool holds = outcome.decision.accepted
                           ? is_near(candidate.T_match_query, outcome.T_match_query,
                                     kRadiusLimit.translation_m, kRadiusLimit.rotation_rad)
                           : is_near(candidate.T_match_query, near->second.T_match_query,
                                     kSameProposalM, kSameProposalRad);
    return holds ? &outcome : nullptr;
  }

  [[nodiscard]] bool has_whole_cloud(const LoopCandidate& candidate) const {
    return loops_.has_whole_cloud(loops_.by_sequence(candidate.query)) &&
           loops_.has_whole_cloud(loops_.by_sequence(candidate.match));
  }

  GrowingLoops& loops_;
  GrowthBudget budget_;
  const UserStatements& statements_;
  KnownLoops known_;
  KnownPlacements placements_;
};

/// All loops, of which later merges know.
class GrowingLoops::Learning final : public LoopSource {
 public:
  Learning(GrowingLoops& loops, const UserStatements& statements, LoopOutcomes* outcomes)
      : loops_(loops),
        searched_(loops.sessions_, loops.config_, statements, loops.clouds_, loops.fingerprints_,
                  outcomes) {}

  std::vector<LoopConstraint> within_sessions() override {
    return learnt(searched_.within_sessions());
  }
  std::vector<LoopConstraint> between_sessions() override {
    return learnt(searched_.between_sessions());
  }
  std::vector<LoopConstraint> links() override { return searched_.links(); }
  PlacementEvidence evaluate(const Placement& placement) override {
    PlacementEvidence evidence = searched_.evaluate(placement);
    loops_.placements_.learn(placement, evidence);
    return evidence;
  }
  std::vector<LoopConstraint> near_each_other(
      const std::vector<LoopCandidate>& candidates) override {
    return searched_.near_each_other(candidates);
  }

 private:
  std::vector<LoopConstraint> learnt(std::vector<LoopConstraint> verified) {
    for (const LoopConstraint& loop : verified) loops_.learn(loop);
    return verified;
  }

  GrowingLoops& loops_;
  SearchedLoops searched_;
};

GrowingLoops::GrowingLoops(const std::vector<SessionData>& sessions, const MergeConfig& config)
    : sessions_(sessions),
      config_(config),
      clouds_(sessions, config.registration, config.threads, config.kept_bytes()),
      fingerprints_(sessions, config),
      places_(kCandidatesPerKeyframe),
      placements_(sessions, config) {}

std::unique_ptr<LoopSource> GrowingLoops::within(const GrowthBudget& budget,
                                                 const UserStatements& statements,
                                                 LoopOutcomes* outcomes) {
  return std::make_unique<UnderBudget>(*this, budget, statements, outcomes);
}

std::unique_ptr<LoopSource> GrowingLoops::all(const UserStatements& statements,
                                              LoopOutcomes* outcomes) {
  return std::make_unique<Learning>(*this, statements, outcomes);
}

void GrowingLoops::take_growth(bool searches) {
  ++merge_;
  const std::vector<SessionChange> changes = growth_.look(sessions_);
  has_grown_ = !changes.empty();
  while (of_session_.size() < sessions_.size()) of_session_.emplace_back(1U);
  places_.expect_sessions(sessions_.size() - std::min<std::size_t>(1, sessions_.size()));
  for (const SessionChange& change : changes) forget(change);
  for (const auto& [s, first, fresh, stale] : changes) {
    for (const std::size_t k : fresh) {
      if (searches) search_within(s, k);
      const KeyframeRecord& keyframe = sessions_[s].keyframes[k];
      const PlaceView place = planes_.place(sessions_[s], k);
      of_session_[s].insert(place, by_sequence({s, k}), keyframe.T_odometry_keyframe);
      places_.insert(place, by_sequence({s, k}), keyframe.T_odometry_keyframe);
    }
  }
  if (!searches) return;
  for (const auto& [s, first, fresh, stale] : changes) {
    for (const std::size_t k : fresh) search_between(s, k);
  }
}

/// What depends on keyframes that are others now, or on clouds that they join.
void GrowingLoops::forget(const SessionChange& change) {
  const auto& keyframes = sessions_[change.session].keyframes;
  std::size_t cloud = std::min(change.first, keyframes.size());
  for (std::uint32_t whole = 0; cloud > 0 && whole < kSubmapKeyframes;) {
    whole += keyframes[--cloud].is_summary ? 0 : 1;
  }
  clouds_.forget_from(change.session, cloud);
  fingerprints_.forget_from(change.session, change.first, cloud);
  const std::set<std::uint32_t> stale(change.stale.begin(), change.stale.end());
  const auto is_stale = [&](const auto& entry) {
    const auto& [a, b] = entry.first;
    return (a.session == change.session && stale.count(a.keyframe) != 0) ||
           (b.session == change.session && stale.count(b.keyframe) != 0);
  };
  if (stale.empty()) return;
  std::erase_if(found_, is_stale);
  std::erase_if(near_, is_stale);
}

/// Only earlier keyframes, as `find_intra_session_candidates`.
void GrowingLoops::search_within(std::size_t session, std::size_t keyframe) {
  const std::vector<double> path = path_lengths_m(sessions_[session]);
  const KeyframeId query = by_sequence({session, keyframe});
  std::uint32_t kept = 0;
  for (const LoopCandidate& candidate : of_session_[session].search(
           planes_.place(sessions_[session], keyframe), query,
           {SearchScope::Sessions::kOnlySame, config_.loops.min_keyframe_gap})) {
    const std::optional<std::size_t> match = index_of(candidate.match);
    if (!match || *match >= keyframe ||
        path[keyframe] - path[*match] < config_.loops.min_path_gap_m) {
      continue;
    }
    find(candidate, kept);
    if (++kept == kCandidatesPerKeyframe) break;
  }
}

void GrowingLoops::search_between(std::size_t session, std::size_t keyframe) {
  std::map<std::uint32_t, std::uint32_t> kept;
  for (const LoopCandidate& candidate :
       places_.search(planes_.place(sessions_[session], keyframe), by_sequence({session, keyframe}),
                      {SearchScope::Sessions::kOnlyOther, 0})) {
    const std::uint32_t rank = kept[candidate.match.session]++;
    if (rank < kCandidatesPerKeyframe) find(candidate, rank);
  }
}

void GrowingLoops::find(const LoopCandidate& candidate, std::uint32_t rank) {
  found_.try_emplace(std::minmax(candidate.query, candidate.match),
                     Found{candidate, rank, merge_, std::nullopt});
}

void GrowingLoops::learn(const LoopConstraint& verified) {
  Found found;
  found.candidate.query = by_sequence(verified.query);
  found.candidate.match = by_sequence(verified.match);
  found.merge = merge_;
  found.outcome = verified;
  found.outcome->query = found.candidate.query;
  found.outcome->match = found.candidate.match;
  found_[std::minmax(found.candidate.query, found.candidate.match)] = std::move(found);
}

/// Candidates that may be verified, the most useful first.
std::vector<GrowingLoops::Pair> GrowingLoops::waiting() const {
  std::map<KeyframeId, std::set<std::uint32_t>> held_by;
  for (const auto& [pair, found] : found_) {
    if (!found.outcome || !found.outcome->decision.accepted) continue;
    if (pair.first.session != pair.second.session) held_by[pair.second].insert(pair.first.session);
  }
  std::vector<const Found*> found_waiting;
  for (const auto& [pair, found] : found_) {
    if (found.outcome || !has_whole_cloud(pair.first) || !has_whole_cloud(pair.second)) continue;
    const auto held = held_by.find(pair.second);
    const bool is_held = held != held_by.end() && held->second.size() >= kSessionsPerKeyframe;
    if (is_held && pair.first.session != pair.second.session) continue;
    found_waiting.push_back(&found);
  }
  const auto order = [](const Found* found) {
    return std::tuple(found->rank, -static_cast<std::int64_t>(found->merge),
                      -found->candidate.confidence, found->candidate.query, found->candidate.match);
  };
  std::sort(found_waiting.begin(), found_waiting.end(),
            [&](const Found* a, const Found* b) { return order(a) < order(b); });
  std::vector<Pair> waiting;
  waiting.reserve(found_waiting.size());
  for (const Found* found : found_waiting) {
    waiting.push_back(std::minmax(found->candidate.query, found->candidate.match));
  }
  return waiting;
}

bool GrowingLoops::has_more() const { return placements_.has_more() || !waiting().empty(); }

/// No keyframe will join its cloud later, unless it is late.
bool GrowingLoops::has_whole_cloud(KeyframeId by_sequence) const {
  const SessionData& session = sessions_[by_sequence.session];
  const std::optional<std::size_t> k = index_of(by_sequence);
  if (!k || session.complete) return k.has_value();
  std::uint32_t after = 0;
  for (std::size_t i = *k + 1; i < session.keyframes.size(); ++i) {
    if (after >= kSubmapKeyframes) break;
    after += session.keyframes[i].is_summary ? 0 : 1;
  }
  return after >= kSubmapKeyframes;
}

std::optional<std::size_t> GrowingLoops::index_of(KeyframeId by_sequence) const {
  const auto& keyframes = sessions_[by_sequence.session].keyframes;
  const auto found = std::lower_bound(
      keyframes.begin(), keyframes.end(), by_sequence.keyframe,
      [](const KeyframeRecord& k, std::uint32_t sequence) { return k.sequence < sequence; });
  if (found == keyframes.end() || found->sequence != by_sequence.keyframe) return std::nullopt;
  return static_cast<std::size_t>(found - keyframes.begin());
}

KeyframeId GrowingLoops::by_sequence(KeyframeId k) const {
  return {k.session, sessions_[k.session].keyframes[k.keyframe].sequence};
}

/// Of keyframes that are there: what is about others was forgotten.
template <typename Loop>
Loop GrowingLoops::at_index(const Loop& by_sequence) const {
  Loop loop = by_sequence;
  loop.query.keyframe = static_cast<std::uint32_t>(*index_of(by_sequence.query));
  loop.match.keyframe = static_cast<std::uint32_t>(*index_of(by_sequence.match));
  return loop;
}

}  // namespace unimapper::merge
