#include "loop_verifier.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "free_space_conflict.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/merge/parallel.hpp"
#include "src/merge/registration/overlap_distances.hpp"
#include "src/merge/registration/weak_axis.hpp"

namespace unimapper::merge {
namespace {

// What registration may tilt a pose although the fit is good, radians: 0.5 degrees.
constexpr double kRegistrationTilt = 0.0087;
// What both keyframes see in common agrees if no more of so many points or more was seen through;
// then this share of the overlap that is needed otherwise is enough
// (docs/design/loop-acceptance.md).
constexpr std::size_t kCommonPoints = 100;
constexpr double kAgreeingLoop = 0.4;
constexpr double kAgreeingOverlap = 2.0 / 3.0;

/// Gates in the order in which they are asked.
class Gates {
 public:
  explicit Gates(GatesAsked asked) : asked_(asked) {}

  /// Whether the candidate is refused here, and not to be measured any further.
  bool ends_over(const char* name, double value, double limit) {
    return ends({name, value, limit, value <= limit});
  }
  bool ends_under(const char* name, double value, double limit) {
    return ends({name, value, limit, value >= limit});
  }
  bool ends_unless(const char* name, bool passed) {
    return ends({name, 0.0, std::numeric_limits<double>::quiet_NaN(), passed});
  }
  [[nodiscard]] std::vector<LoopGate> take() { return std::move(gates_); }

 private:
  bool ends(const LoopGate& gate) {
    gates_.push_back(gate);
    return !gate.passed && asked_ == GatesAsked::kUntilRefused;
  }

  GatesAsked asked_;
  std::vector<LoopGate> gates_;
};

std::string reason_to_refuse(const std::vector<LoopGate>& gates) {
  const auto refused =
      std::find_if(gates.begin(), gates.end(), [](const LoopGate& gate) { return !gate.passed; });
  if (refused == gates.end()) return {};
  if (std::isnan(refused->limit)) return refused->name;
  char text[96];
  std::snprintf(text, sizeof text, "%s %.2f (limit %.2f)", refused->name, refused->value,
                refused->limit);
  return text;
}

/// Least overlap after registration. It is a share of all that one keyframe sees, which a LiDAR
/// with another field of view cannot cover: less will do where both see the same in common.
double least_overlap(const CommonView& view, const LoopConfig& loops) {
  const bool agrees = view.observed >= kCommonPoints && view.contradiction <= kAgreeingLoop;
  return agrees ? kAgreeingOverlap * loops.min_overlap : loops.min_overlap;
}

}  // namespace

std::vector<LoopGate> ask_gates(const LoopCandidate& candidate, const CorrectionLimit& limit,
                                const KeyframeClouds& clouds, const MergeConfig& config,
                                GatesAsked asked, LoopConstraint& constraint) {
  const LoopConfig& loops = config.loops;
  const auto target_cloud = clouds.cloud(candidate.match);
  const auto source_cloud = clouds.cloud(candidate.query);
  const RegistrationCloud& target = *target_cloud;
  const RegistrationCloud& source = *source_cloud;
  Gates gates(asked);
  const Pose& proposed = candidate.T_match_query;
  if (!proposed.is_rigid()) {
    gates.ends_unless("the proposed pose is no rigid transform", false);
    return gates.take();
  }
  const TiltPrior prior(clouds.record(candidate.match).up, clouds.record(candidate.query).up,
                        proposed);
  if (gates.ends_under(
          "overlap before alignment",
          structure_overlap(target, source, proposed, kOverlapRadiusM, kCoarseDistanceM),
          kMinInitialOverlap)) {
    return gates.take();
  }
  const RegistrationResult aligned =
      register_clouds(target, source, proposed, config.registration, prior.information());
  if (gates.ends_unless("alignment did not converge", aligned.converged)) return gates.take();
  const Pose& T = aligned.T_target_source;
  constraint.T_match_query = T;
  constraint.information = aligned.information;
  constraint.overlap = structure_overlap(target, source, T, kOverlapRadiusM, kFineDistanceM);
  const Pose correction = proposed.inverse() * T;
  if (gates.ends_over("alignment moved it by metres", correction.translation.norm(),
                      limit.translation_m) ||
      gates.ends_over("alignment turned it by radians", rotation_angle(correction.rotation),
                      limit.rotation_rad) ||
      gates.ends_over("tilt in sigmas", prior.sigmas(tilt_of(T), kRegistrationTilt),
                      kMaxTiltSigmas)) {
    return gates.take();
  }
  CommonView view;
  if (constraint.overlap >= kAgreeingOverlap * loops.min_overlap || asked == GatesAsked::kAll) {
    view = common_view(clouds, candidate.match, candidate.query, T);
  }
  if (gates.ends_under("overlap", constraint.overlap, least_overlap(view, loops)) ||
      gates.ends_over("structure in free space", view.contradiction, loops.max_contradiction)) {
    return gates.take();
  }
  const WeakAxis weak =
      probe_weak_axis(target, source, aligned, config.registration, prior.information());
  if (weak.slip_m > RegistrationConfig::kProbeSlipM) {
    constraint.information = weakened(aligned.information, weak.axis);
  }
  return gates.take();
}

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
    loop.decision.reason = reason_to_refuse(
        ask_gates(candidates[i], limit, clouds, config, GatesAsked::kUntilRefused, loop));
    loop.decision.accepted = loop.decision.reason.empty();
  });
  return loops;
}

}  // namespace unimapper::merge
