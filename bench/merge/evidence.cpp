// Evidence of sensor data on the inter-session loops and the placement of two runs, as one line of
// figures
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <numbers>
#include <span>
#include <string_view>
#include <vector>

#include "ports/lcm/received_log.hpp"
#include "src/merge/free_space_conflict.hpp"
#include "src/merge/loop_acceptance.hpp"
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

std::array<std::vector<Pose>, 2> odometry_of(const std::vector<SessionData>& sessions) {
  std::array<std::vector<Pose>, 2> poses;
  for (std::size_t s = 0; s < 2; ++s) {
    for (const KeyframeRecord& keyframe : sessions[s].keyframes) {
      poses[s].push_back(keyframe.T_odometry_keyframe);
    }
  }
  return poses;
}

/// Placements that are wrong: the query moved along its way, turned round, put on another storey.
std::vector<Pose> wrong_placements(const Pose& right, const std::vector<LoopConstraint>& loops,
                                   const std::vector<Pose>& query) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const LoopConstraint& loop : loops) {
    centre += (right * query[loop.query.keyframe]).translation;
  }
  centre /= static_cast<double>(loops.size());
  Eigen::Vector3d ahead = (right * query[loops.front().query.keyframe]).rotation.col(0);
  ahead.z() = 0.0;
  ahead.normalize();
  std::vector<Pose> moves;
  for (const double shift_m : {-35.0, -20.0, -12.0, -6.0, 6.0, 12.0, 20.0, 35.0}) {
    moves.emplace_back(Eigen::Matrix3d::Identity(), shift_m * ahead);
  }
  const Eigen::Matrix3d round =
      Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  moves.emplace_back(round, centre - round * centre);
  moves.emplace_back(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0, 0.0, 3.2));
  for (Pose& move : moves) move = move * right;
  return moves;
}

/// Votes of neighbours: agreeing, differing and none where loops put the query, the same summed
/// over wrong placements, and how many of these the votes let through, of how many.
void print_votes(const std::vector<SessionData>& sessions) {
  const MergeConfig config;
  KeyframeClouds clouds(sessions, config.registration, config.threads);
  const std::vector<LoopConstraint> all = verified_loops(sessions, clouds, config);
  const auto poses = odometry_of(sessions);
  const ConsistencySet set =
      inter_session_consistency(all, SessionPath(poses[1], config.odometry),
                                SessionPath(poses[0], config.odometry), config.acceptance);
  std::vector<LoopConstraint> loops;
  for (const std::size_t i : set.inliers) loops.push_back(all[i]);
  if (loops.empty()) throw std::runtime_error("no consistent loops");
  PlacementEvaluator evaluator(sessions, clouds, config);
  using Vote = PlacementEvaluator::Vote;
  const auto ask = [&](const Pose& T_match_query, std::array<std::size_t, 3>& counts) {
    std::array<std::size_t, 3> votes{};
    for (const Vote vote : evaluator.ask_neighbours({loops, poses[1], poses[0], T_match_query})) {
      ++votes[vote == Vote::kAgrees ? 0 : vote == Vote::kDiffers ? 1 : 2];
    }
    for (std::size_t i = 0; i < 3; ++i) counts[i] += votes[i];
    return votes[1] <= votes[0];
  };
  const Pose& right = set.T_match_session_query_session;
  std::array<std::size_t, 3> at_right{};
  std::array<std::size_t, 3> at_wrong{};
  ask(right, at_right);
  std::size_t passed = 0;
  const std::vector<Pose> wrong = wrong_placements(right, loops, poses[1]);
  for (const Pose& placement : wrong) passed += ask(placement, at_wrong) ? 1 : 0;
  for (const auto& counts : {at_right, at_wrong}) {
    std::printf("%zu %zu %zu ", counts[0], counts[1], counts[2]);
  }
  std::printf("%zu %zu\n", passed, wrong.size());
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
        common_view(clouds, loop.match, loop.query, loop.T_match_query, config).contradiction);
    roofed.push_back(roofed_share(*clouds.whole(loop.match)));
    roofed.push_back(roofed_share(*clouds.whole(loop.query)));
  }
  print_range(conflicts);
  print_range(roofed);
  print_weak_axes(loops, clouds, config);
  std::vector<double> shares;
  if (!loops.empty()) {
    const auto poses = odometry_of(sessions);
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
  const bool votes = argc == 4 && std::string_view(argv[1]) == "--votes";
  if (argc != 3 && !votes) {
    std::fprintf(stderr,
                 "usage: merge_evidence_bench [--votes] KEYFRAMES.lcmlog KEYFRAMES.lcmlog\n");
    return 2;
  }
  try {
    std::vector<SessionData> sessions;
    for (int i = argc - 2; i < argc; ++i) {
      for (SessionData& session : lcm_port::read_event_log(argv[i]).sessions) {
        sessions.push_back(std::move(session));
      }
    }
    if (sessions.size() != 2) throw std::runtime_error("each log must hold one session");
    votes ? print_votes(sessions) : print_evidence(sessions);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "merge_evidence_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
