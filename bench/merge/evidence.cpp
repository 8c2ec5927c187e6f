// Evidence of sensor data on the inter-session loops of two runs, as one line of figures
#include <algorithm>
#include <cstdio>
#include <exception>
#include <span>
#include <vector>

#include "ports/lcm/received_log.hpp"
#include "src/merge/free_space_conflict.hpp"
#include "src/merge/loop_search.hpp"
#include "src/merge/loop_verifier.hpp"
#include "src/merge/placement_check.hpp"
#include "src/merge/roofed_share.hpp"
#include "src/merge/weak_axis.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/core/tilt_prior.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// Smallest, median and largest of some figures.
void print_range(std::vector<double> values) {
  if (values.empty()) values.push_back(0.0);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double least = *low;
  const double most = *high;
  std::printf(" %.3f %.3f %.3f", least, median(std::span(values)), most);
}

std::vector<LoopConstraint> verified_loops(const std::vector<SessionData>& sessions,
                                           KeyframeClouds& clouds, const MergeConfig& config) {
  const CorrectionLimit limit{config.loops.max_correction_m, config.loops.max_correction_rad};
  std::vector<LoopConstraint> loops =
      verify_loops(find_inter_session_candidates(sessions, config.loops), limit, clouds, config);
  std::erase_if(loops, [](const LoopConstraint& loop) { return !loop.decision.accepted; });
  // As alignment has them: the lower session as match.
  for (LoopConstraint& loop : loops) {
    if (loop.query.session != 0) continue;
    std::swap(loop.query, loop.match);
    loop.T_match_query = loop.T_match_query.inverse();
  }
  return loops;
}

/// Registrations restarted: how many slip, and how far those end that do not.
void print_weak_axes(const std::vector<LoopConstraint>& loops, const KeyframeClouds& clouds,
                     const MergeConfig& config) {
  std::vector<double> conditions;
  std::size_t slipped = 0;
  double others_m = 0.0;
  for (const LoopConstraint& loop : loops) {
    const auto target_cloud = clouds.cloud(loop.match);
    const auto source_cloud = clouds.cloud(loop.query);
    const RegistrationCloud& target = *target_cloud;
    const RegistrationCloud& source = *source_cloud;
    const TiltPrior prior(clouds.record(loop.match).up, clouds.record(loop.query).up,
                          loop.T_match_query, config.loops.tilt);
    const RegistrationResult aligned = register_clouds(target, source, loop.T_match_query,
                                                       config.registration, prior.information());
    conditions.push_back(aligned.condition);
    const double slip_m =
        probe_weak_axis(target, source, aligned, config.registration, prior.information()).slip_m;
    if (slip_m > config.registration.probe_slip_m) {
      ++slipped;
    } else {
      others_m = std::max(others_m, slip_m);
    }
  }
  print_range(conditions);
  std::printf(" %zu %.2f", slipped, others_m);
}

void print_evidence(const std::vector<SessionData>& sessions) {
  const MergeConfig config;
  KeyframeClouds clouds(sessions, config.registration, config.threads);
  const std::vector<LoopConstraint> loops = verified_loops(sessions, clouds, config);
  std::printf("%zu", loops.size());
  std::vector<double> conflicts;
  std::vector<double> roofed;
  for (const LoopConstraint& loop : loops) {
    conflicts.push_back(
        structure_in_free_space(clouds, loop.match, loop.query, loop.T_match_query, config));
    roofed.push_back(roofed_share(*clouds.whole(loop.match)));
    roofed.push_back(roofed_share(*clouds.whole(loop.query)));
  }
  print_range(conflicts);
  print_range(roofed);
  print_weak_axes(loops, clouds, config);
  std::vector<double> shares;
  if (!loops.empty()) {
    std::vector<Pose> poses[2];
    for (std::size_t s = 0; s < 2; ++s) {
      for (const KeyframeRecord& keyframe : sessions[s].keyframes) {
        poses[s].push_back(keyframe.T_odometry_keyframe);
      }
    }
    PlacementEvaluator evaluator(sessions, clouds, config);
    for (const auto& of_loop : evaluator.look_elsewhere({loops, poses[1], poses[0], Pose{}})) {
      shares.push_back(of_loop.best_share);
    }
  }
  print_range(shares);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: merge_evidence_bench KEYFRAMES.lcmlog KEYFRAMES.lcmlog\n");
    return 2;
  }
  try {
    std::vector<SessionData> sessions;
    for (int i = 1; i < 3; ++i) {
      for (SessionData& session : lcm_port::read_event_log(argv[i]).sessions) {
        sessions.push_back(std::move(session));
      }
    }
    if (sessions.size() != 2) throw std::runtime_error("each log must hold one session");
    print_evidence(sessions);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "merge_evidence_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
