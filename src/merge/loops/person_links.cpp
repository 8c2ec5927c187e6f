// Registration of a person's links, and their place among other loops.
#include "person_links.hpp"

#include <algorithm>
#include <numbers>
#include <optional>

#include "free_space_conflict.hpp"
#include "link_check.hpp"
#include "loop_cycle.hpp"

namespace unimapper::merge {
namespace {

constexpr int kHeadings = 8;
constexpr double kSigmaM = 0.5;
constexpr double kSigmaRad = 0.05;

/// Poses that registration may start from.
std::vector<LoopCandidate> starts_of(const KeyframeLink& link) {
  LoopCandidate candidate;
  candidate.query = link.query;
  candidate.match = link.match;
  candidate.confidence = 1.0F;
  candidate.accepted = true;
  if (link.T_match_query) {
    candidate.T_match_query = *link.T_match_query;
    return {candidate};
  }
  std::vector<LoopCandidate> candidates;
  for (int i = 0; i < kHeadings; ++i) {
    const double yaw = 2.0 * std::numbers::pi * i / kHeadings;
    candidate.T_match_query.rotation =
        Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    candidates.push_back(candidate);
  }
  return candidates;
}

/// Half of what lies between two headings, and what a person calls the same position.
constexpr CorrectionLimit kLinkLimit{2.0 * kDescriptorLimit.translation_m,
                                     std::numbers::pi / kHeadings + kDescriptorLimit.rotation_rad};

LoopConstraint as_said(const KeyframeLink& link) {
  LoopConstraint loop;
  loop.query = link.query;
  loop.match = link.match;
  loop.T_match_query = *link.T_match_query;
  loop.information.setIdentity();
  loop.information.topLeftCorner<3, 3>() *= 1.0 / (kSigmaM * kSigmaM);
  loop.information.bottomRightCorner<3, 3>() *= 1.0 / (kSigmaRad * kSigmaRad);
  loop.confidence = 1.0F;
  loop.decision.accepted = true;
  return loop;
}

}  // namespace

std::vector<LoopConstraint> link_loops(const std::vector<KeyframeLink>& links, KnownLoops& known,
                                       KeyframeClouds& clouds) {
  std::vector<LoopConstraint> loops;
  for (const KeyframeLink& link : links) {
    std::optional<LoopConstraint> best;
    for (LoopConstraint& loop : known.verify(starts_of(link), kLinkLimit, clouds)) {
      if (loop.decision.accepted && (!best || loop.overlap > best->overlap)) best = loop;
    }
    if (!best && link.T_match_query) best = as_said(link);
    if (!best) {
      best = LoopConstraint{};
      best->query = link.query;
      best->match = link.match;
      best->decision.reason =
          std::string(kLinkedByPerson) + ", but no registration confirms it: say its pose";
    }
    best->by_person = best->decision.accepted;
    loops.push_back(*best);
  }
  return loops;
}

LinkEvidence check_link(const std::vector<SessionData>& sessions, const KeyframeLink& link,
                        const MergeConfig& config) {
  KeyframeClouds clouds(sessions, config.registration, config.threads);
  const std::vector<LoopConstraint> loops =
      verify_loops(starts_of(link), kLinkLimit, clouds, config);
  LinkEvidence evidence;
  evidence.is_confirmed = std::any_of(loops.begin(), loops.end(), [](const LoopConstraint& loop) {
    return loop.decision.accepted;
  });
  if (evidence.is_confirmed || !link.T_match_query) return evidence;
  const CommonView view = common_view(clouds, link.match, link.query, *link.T_match_query);
  evidence.observed = view.observed;
  evidence.seen_through = view.contradiction;
  evidence.is_contradicted =
      view.is_enough() && view.contradiction > config.loops.max_contradiction;
  return evidence;
}

bool has_person_link(const std::vector<LoopConstraint>& loops) {
  return std::any_of(loops.begin(), loops.end(),
                     [](const LoopConstraint& loop) { return loop.by_person; });
}

ConsistencySet linked_consistency(const std::vector<LoopConstraint>& loops,
                                  const SessionPath& query, const SessionPath& match,
                                  const AcceptanceConfig& config) {
  ConsistencySet set;
  set.state = PairState::kConfirmed;
  const auto first = std::find_if(loops.begin(), loops.end(),
                                  [](const LoopConstraint& loop) { return loop.by_person; });
  std::vector<std::size_t> links;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const bool agrees = cycle_chi2(*first, loops[i], query, match) <= config.consistency_chi2;
    if (loops[i].by_person) links.push_back(i);
    if (loops[i].by_person || agrees) set.inliers.push_back(i);
  }
  set.distinct = set.inliers.size();
  set.T_match_session_query_session = fit_session_transform(loops, links, query, match);
  return set;
}

void choose_person_links(const std::vector<LoopConstraint>& loops,
                         std::vector<std::size_t>& chosen) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (!loops[i].by_person) continue;
    const auto position = std::lower_bound(chosen.begin(), chosen.end(), i);
    if (position == chosen.end() || *position != i) chosen.insert(position, i);
  }
}

}  // namespace unimapper::merge
