#include "verified_loops.hpp"

#include <algorithm>
#include <utility>

namespace unimapper::merge {

bool UserStatements::forbid(KeyframeId query, KeyframeId match) const {
  return std::any_of(forbidden.begin(), forbidden.end(), [&](const KeyframePair& pair) {
    return (pair.a == query && pair.b == match) || (pair.a == match && pair.b == query);
  });
}

bool UserStatements::keep_apart(std::uint32_t session) const {
  return std::find(apart.begin(), apart.end(), session) != apart.end();
}

KnownLoops::KnownLoops(const MergeConfig& config, const UserStatements& statements,
                       LoopFingerprints& fingerprints, LoopOutcomes* outcomes)
    : config_(config), statements_(statements), outcomes_(outcomes), fingerprints_(fingerprints) {}

const char* KnownLoops::refusal(KeyframeId query, KeyframeId match) const {
  if (statements_.forbid(query, match)) return kForbiddenByPerson;
  const bool apart = query.session != match.session && (statements_.keep_apart(query.session) ||
                                                        statements_.keep_apart(match.session));
  return apart ? kApartByPerson : nullptr;
}

std::vector<LoopConstraint> KnownLoops::verify(std::span<const LoopCandidate> candidates,
                                               const CorrectionLimit& limit,
                                               KeyframeClouds& clouds) {
  std::vector<LoopConstraint> loops(candidates.size());
  std::vector<LoopCandidate> unknown;
  std::vector<std::size_t> positions;
  std::vector<LoopOutcomes::Entry> entries;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const LoopCandidate& candidate = candidates[i];
    if (const char* reason = refusal(candidate.query, candidate.match)) {
      loops[i].query = candidate.query;
      loops[i].match = candidate.match;
      loops[i].T_match_query = candidate.T_match_query;
      loops[i].confidence = candidate.confidence;
      loops[i].decision.reason = reason;
      continue;
    }
    LoopQuestion question{candidate.query, candidate.match, candidate.T_match_query, 0};
    if (outcomes_ != nullptr) {
      question.fingerprint = fingerprints_.of(candidate.query, candidate.match, limit);
      if (std::optional<LoopConstraint> known = outcomes_->find(question)) {
        loops[i] = std::move(*known);
        loops[i].query = candidate.query;
        loops[i].match = candidate.match;
        loops[i].confidence = candidate.confidence;
        continue;
      }
    }
    unknown.push_back(candidate);
    positions.push_back(i);
    entries.push_back({question, {}});
  }
  std::vector<LoopConstraint> verified = verify_loops(unknown, limit, clouds, config_);
  verified_ += verified.size();
  for (std::size_t i = 0; i < verified.size(); ++i) {
    entries[i].outcome = verified[i];
    loops[positions[i]] = std::move(verified[i]);
  }
  if (outcomes_ != nullptr && !entries.empty()) outcomes_->keep(entries);
  return loops;
}

}  // namespace unimapper::merge
