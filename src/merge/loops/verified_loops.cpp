#include "verified_loops.hpp"

#include <algorithm>
#include <numeric>
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

std::vector<LoopConstraint> LoopOutcomes::verify(std::span<const LoopQuestion> questions,
                                                 const CorrectionLimit& /*limit*/,
                                                 const VerifyHere& verify_here) {
  std::vector<std::size_t> all(questions.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return verify_here(all);
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
  std::vector<LoopQuestion> questions;
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
    questions.push_back(question);
  }
  std::vector<LoopConstraint> verified = verify(unknown, questions, limit, clouds);
  verified_ += verified.size();
  std::vector<LoopOutcomes::Entry> entries;
  for (std::size_t i = 0; i < verified.size(); ++i) {
    verified[i].query = unknown[i].query;
    verified[i].match = unknown[i].match;
    verified[i].confidence = unknown[i].confidence;
    entries.push_back({questions[i], verified[i]});
    loops[positions[i]] = std::move(verified[i]);
  }
  if (outcomes_ != nullptr && !entries.empty()) outcomes_->keep(entries);
  return loops;
}

std::vector<LoopConstraint> KnownLoops::verify(std::span<const LoopCandidate> unknown,
                                               std::span<const LoopQuestion> questions,
                                               const CorrectionLimit& limit,
                                               KeyframeClouds& clouds) {
  if (outcomes_ == nullptr) return verify_loops(unknown, limit, clouds, config_);
  return outcomes_->verify(questions, limit, [&](std::span<const std::size_t> positions) {
    std::vector<LoopCandidate> chosen;
    chosen.reserve(positions.size());
    for (const std::size_t i : positions) chosen.push_back(unknown[i]);
    return verify_loops(chosen, limit, clouds, config_);
  });
}

}  // namespace unimapper::merge
