// Optimisation with outlier rejection, shared by joining and refinement.
#include "alignment_problem.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace unimapper::merge {
namespace {

constexpr int kMaxRejectionRounds = 4;

void check_loop(const LoopConstraint& loop, const std::vector<AlignmentSession>& sessions) {
  for (const KeyframeId k : {loop.query, loop.match}) {
    if (k.session >= sessions.size() ||
        k.keyframe >= sessions[k.session].T_odometry_keyframe.size()) {
      throw std::invalid_argument("loop between keyframes that do not exist");
    }
  }
  if (loop.query == loop.match) throw std::invalid_argument("loop of a keyframe to itself");
}

}  // namespace

AlignmentProblem::AlignmentProblem(const std::vector<AlignmentSession>& all_sessions,
                                   std::span<const LoopConstraint> all_loops,
                                   const MergeConfig& merge_config)
    : config(merge_config), sessions(all_sessions) {
  std::vector<SessionPath> odometry;
  odometry.reserve(sessions.size());
  for (const auto& session : sessions) {
    odometry.emplace_back(session.T_odometry_keyframe, config.odometry);
  }
  state = make_map_state(std::move(odometry));
  loops.reserve(all_loops.size());
  for (const auto& loop : all_loops) {
    check_loop(loop, sessions);
    loops.push_back(loop.query.session < loop.match.session ? flipped(loop) : loop);
  }
  decisions.resize(loops.size());
  reasons.resize(sessions.size());
}

std::vector<LoopConstraint> AlignmentProblem::select(std::span<const std::size_t> indices) const {
  std::vector<LoopConstraint> chosen;
  chosen.reserve(indices.size());
  for (const std::size_t i : indices) chosen.push_back(loops[i]);
  return chosen;
}

bool AlignmentProblem::optimize_rejecting_outliers(MapState& trial,
                                                   std::span<const std::size_t> which_sessions,
                                                   std::vector<std::size_t>& chosen) const {
  for (int round = 0; round < kMaxRejectionRounds; ++round) {
    if (!optimize_maps(trial, which_sessions, select(chosen), config.graph)) return false;
    const auto is_outlier = [&](std::size_t i) {
      return !loops[i].by_person && loop_chi2(trial, loops[i]) > config.acceptance.loop_chi2;
    };
    if (std::erase_if(chosen, is_outlier) == 0) break;
  }
  return true;
}

bool AlignmentProblem::all_plausible(const MapState& after,
                                     std::span<const std::size_t> which_sessions) const {
  return std::all_of(which_sessions.begin(), which_sessions.end(), [&](std::size_t s) {
    return deformation_is_plausible(state, after, s, config.graph);
  });
}

Alignment AlignmentProblem::result() const {
  Alignment alignment;
  alignment.central = state.central;
  alignment.connected = state.connected;
  alignment.reason = reasons;
  alignment.T_map_session = state.T_map_session;
  alignment.T_session_keyframe = state.T_session_keyframe;
  alignment.decisions = decisions;
  alignment.pairs = pairs;
  return alignment;
}

}  // namespace unimapper::merge
