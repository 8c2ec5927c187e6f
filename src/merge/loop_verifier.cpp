#include "loop_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "parallel.hpp"

namespace unimapper::merge {
namespace {

constexpr double kOverlapRadiusM = 30.0;
constexpr double kCoarseDistanceM = 1.5;
constexpr double kFineDistanceM = 0.5;
constexpr float kContradictionRangeM = 25.0F;

double tilt(const Pose& T) { return std::acos(std::clamp(T.rotation(2, 2), -1.0, 1.0)); }

std::string sentence(const char* what, double value, double limit) {
  char text[96];
  std::snprintf(text, sizeof text, "%s %.2f (limit %.2f)", what, value, limit);
  return text;
}

/// Share of `source`'s structure that lies where `view` saw free space, of all it can judge.
double contradiction(const FreeSpaceView& view, const RegistrationCloud& source, const Pose& T,
                     float margin_m) {
  const Eigen::Matrix3f r = T.rotation.cast<float>();
  const Eigen::Vector3f t = T.translation.cast<float>();
  std::size_t free = 0;
  std::size_t judged = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source.is_ground(i)) continue;
    const Eigen::Vector3f p = r * source.points()[i] + t;
    if (p.squaredNorm() > kContradictionRangeM * kContradictionRangeM) continue;
    const Visibility seen = view.look(p, margin_m);
    if (seen == Visibility::kUnknown) continue;
    ++judged;
    if (seen == Visibility::kFree) ++free;
  }
  return judged < 50 ? 0.0 : static_cast<double>(free) / static_cast<double>(judged);
}

std::string reason_to_refuse(const LoopCandidate& candidate, const CorrectionLimit& limit,
                             const KeyframeClouds& clouds, const MergeConfig& config,
                             LoopConstraint& constraint) {
  const LoopConfig& loops = config.loops;
  const RegistrationCloud& target = clouds.cloud(candidate.match);
  const RegistrationCloud& source = clouds.cloud(candidate.query);
  if (!candidate.T_match_query.is_rigid()) return "the proposed pose is no rigid transform";
  if (tilt(candidate.T_match_query) > loops.max_tilt_rad) return "not level";
  const double before =
      structure_overlap(target, source, candidate.T_match_query, kOverlapRadiusM, kCoarseDistanceM);
  if (before < loops.min_initial_overlap) {
    return sentence("overlap before alignment", before, loops.min_initial_overlap);
  }
  const RegistrationResult aligned =
      register_clouds(target, source, candidate.T_match_query, config.registration);
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
  if (tilt(T) > loops.max_tilt_rad) return "not level after alignment";
  if (constraint.overlap < loops.min_overlap) {
    return sentence("overlap", constraint.overlap, loops.min_overlap);
  }
  if (aligned.rmse_m > loops.max_rmse_m) {
    return sentence("rmse in metres", aligned.rmse_m, loops.max_rmse_m);
  }
  const double conflict = std::max(
      contradiction(clouds.view(candidate.match), source, T, config.map.free_margin_m),
      contradiction(clouds.view(candidate.query), target, T.inverse(), config.map.free_margin_m));
  if (conflict > loops.max_contradiction) {
    return sentence("structure in free space", conflict, loops.max_contradiction);
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
  parallel_for(candidates.size(), config.threads, [&](std::size_t i) {
    LoopConstraint& loop = loops[i];
    loop.query = candidates[i].query;
    loop.match = candidates[i].match;
    loop.T_match_query = candidates[i].T_match_query;
    loop.confidence = candidates[i].confidence;
    loop.decision.reason = reason_to_refuse(candidates[i], limit, clouds, config, loop);
    loop.decision.accepted = loop.decision.reason.empty();
  });
  return loops;
}

}  // namespace unimapper::merge
