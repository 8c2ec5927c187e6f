#include "loop_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <tuple>

#include "free_space_conflict.hpp"
#include "overlap_distances.hpp"
#include "parallel.hpp"
#include "unimapper/core/tilt_prior.hpp"
#include "weak_axis.hpp"

namespace unimapper::merge {
namespace {

// What registration may tilt a pose although the fit is good, radians: 0.5 degrees.
constexpr double kRegistrationTilt = 0.0087;
// How far the tilt of a candidate may be from that of the registered pose, radians: 1 degree.
constexpr double kCandidateTilt = 0.0175;

std::string sentence(const char* what, double value, double limit) {
  char text[96];
  std::snprintf(text, sizeof text, "%s %.2f (limit %.2f)", what, value, limit);
  return text;
}

std::string reason_to_refuse_loop(const LoopCandidate& candidate, const CorrectionLimit& limit,
                                  const KeyframeClouds& clouds, const MergeConfig& config,
                                  LoopConstraint& constraint) {
  const LoopConfig& loops = config.loops;
  const auto target_cloud = clouds.cloud(candidate.match);
  const auto source_cloud = clouds.cloud(candidate.query);
  const RegistrationCloud& target = *target_cloud;
  const RegistrationCloud& source = *source_cloud;
  if (!candidate.T_match_query.is_rigid()) return "the proposed pose is no rigid transform";
  const TiltPrior prior(clouds.record(candidate.match).up, clouds.record(candidate.query).up,
                        candidate.T_match_query, loops.tilt);
  const auto max_sigmas = static_cast<double>(loops.tilt.max_sigmas);
  const double proposed = prior.sigmas(tilt_of(candidate.T_match_query), kCandidateTilt);
  if (proposed > max_sigmas)
    return sentence("tilt before alignment in sigmas", proposed, max_sigmas);
  const double before =
      structure_overlap(target, source, candidate.T_match_query, kOverlapRadiusM, kCoarseDistanceM);
  if (before < loops.min_initial_overlap) {
    return sentence("overlap before alignment", before, loops.min_initial_overlap);
  }
  const RegistrationResult aligned = register_clouds(target, source, candidate.T_match_query,
                                                     config.registration, prior.information());
  if (!aligned.converged) return "alignment did not converge";
  const Pose& T = aligned.T_target_source;
  constraint.T_match_query = T;
  constraint.information = aligned.information;
  constraint.overlap = structure_overlap(target, source, T, kOverlapRadiusM, kFineDistanceM);
  const Pose correction = candidate.T_match_query.inverse() * T;
  if (correction.translation.norm() > limit.translation_m) {
    return sentence("alignment moved it by metres", correction.translation.norm(),
                    limit.translation_m);
  }
  if (rotation_angle(correction.rotation) > limit.rotation_rad) {
    return sentence("alignment turned it by radians", rotation_angle(correction.rotation),
                    limit.rotation_rad);
  }
  const double tilt = prior.sigmas(tilt_of(T), kRegistrationTilt);
  if (tilt > max_sigmas) return sentence("tilt in sigmas", tilt, max_sigmas);
  if (constraint.overlap < loops.min_overlap) {
    return sentence("overlap", constraint.overlap, loops.min_overlap);
  }
  if (aligned.rmse_m > loops.max_rmse_m) {
    return sentence("rmse in metres", aligned.rmse_m, loops.max_rmse_m);
  }
  const double conflict =
      common_view(clouds, candidate.match, candidate.query, T, config).contradiction;
  if (conflict > loops.max_contradiction) {
    return sentence("structure in free space", conflict, loops.max_contradiction);
  }
  const WeakAxis weak =
      probe_weak_axis(target, source, aligned, config.registration, prior.information());
  if (weak.slip_m > config.registration.probe_slip_m) {
    constraint.information = weakened(aligned.information, weak.axis, config.registration);
  }
  return {};
}

}  // namespace

std::vector<LoopConstraint> verify_loops(std::span<const LoopCandidate> candidates,
                                         const CorrectionLimit& limit, KeyframeClouds& clouds,
                                         const MergeConfig& config) {
  std::vector<KeyframeId> needed;
  for (const auto& candidate : candidates) {
    needed.push_back(candidate.query);
    needed.push_back(candidate.match);
  }
  clouds.prepare(std::move(needed));
  std::vector<LoopConstraint> loops(candidates.size());
  // Candidates that share a cloud follow each other: it may not be kept for long.
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(candidates[a].match, candidates[a].query, a) <
           std::tie(candidates[b].match, candidates[b].query, b);
  });
  parallel_for(candidates.size(), config.threads, [&](std::size_t next) {
    const std::size_t i = order[next];
    LoopConstraint& loop = loops[i];
    loop.query = candidates[i].query;
    loop.match = candidates[i].match;
    loop.T_match_query = candidates[i].T_match_query;
    loop.confidence = candidates[i].confidence;
    loop.decision.reason = reason_to_refuse_loop(candidates[i], limit, clouds, config, loop);
    loop.decision.accepted = loop.decision.reason.empty();
  });
  return loops;
}

}  // namespace unimapper::merge
