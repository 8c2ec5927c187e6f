// Refinement of an alignment with radius loops (paper section VI).
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "alignment_problem.hpp"
#include "src/merge/loops/loop_acceptance.hpp"

namespace unimapper::merge {
namespace {

/// Adds loops rejected before whose residual in `state` is well within the gate. False: none.
bool readmit(const AlignmentProblem& problem, const MapState& state,
             std::vector<std::size_t>& chosen) {
  std::vector<std::size_t> readmitted;
  for (std::size_t i = 0; i < problem.loops.size(); ++i) {
    if (!problem.state.connects(problem.loops[i]) ||
        std::binary_search(chosen.begin(), chosen.end(), i)) {
      continue;
    }
    if (loop_chi2(state, problem.loops[i]) < 0.5 * problem.config.acceptance.loop_chi2) {
      readmitted.push_back(i);
    }
  }
  chosen.insert(chosen.end(), readmitted.begin(), readmitted.end());
  std::sort(chosen.begin(), chosen.end());
  return !readmitted.empty();
}

void start_from(const Alignment& start, AlignmentProblem& problem) {
  problem.state.central = start.central;
  problem.state.connected = start.connected;
  problem.state.T_map_session = start.T_map_session;
  problem.state.T_session_keyframe = start.T_session_keyframe;
  problem.reasons = start.reason;
  problem.pairs = start.pairs;
  problem.state.T_map_site = start.T_map_site;
  for (const PositionOutcome& position : start.positions) {
    if (position.used) {
      problem.state.positions.push_back(position.given);
    } else {
      problem.rejected.push_back(position);
    }
  }
  std::copy(start.decisions.begin(), start.decisions.end(), problem.decisions.begin());
  for (std::size_t s = 0; s < start.drift_scale.size(); ++s) {
    problem.set_drift(s, start.drift_scale[s]);
  }
}

/// Takes the new loops within sessions out that nothing confirms: one alone bends its session
/// wherever it is wrong. They may be readmitted where the result agrees with them.
void let_unconfirmed_wait(AlignmentProblem& problem, std::size_t earlier,
                          std::vector<std::size_t>& chosen) {
  std::vector<std::vector<std::size_t>> within(problem.sessions.size());
  for (const std::size_t i : chosen) {
    const LoopConstraint& loop = problem.loops[i];
    if (loop.is_intra_session()) within[loop.query.session].push_back(i);
  }
  std::erase_if(chosen, [&](std::size_t i) {
    const LoopConstraint& loop = problem.loops[i];
    const std::size_t s = loop.query.session;
    if (i < earlier || !loop.is_intra_session()) return false;
    const AcceptanceConfig rules =
        scaled_to_extent(problem.config.acceptance, problem.sessions[s].extent_m);
    if (is_confirmed(problem.loops, within[s], i, problem.state.odometry[s], rules)) return false;
    problem.decisions[i] = {false, kWaits};
    return true;
  });
}

/// Takes the refined state over. The chosen loops are accepted; all other new ones, and those
/// accepted before, disagree with it. Loops rejected before, and those that wait, keep their
/// reason.
void adopt(MapState refined, const std::vector<std::size_t>& chosen, std::size_t earlier,
           AlignmentProblem& problem) {
  problem.state = std::move(refined);
  for (std::size_t i = 0; i < problem.loops.size(); ++i) {
    LoopDecision& decision = problem.decisions[i];
    if (std::binary_search(chosen.begin(), chosen.end(), i)) {
      decision = {true, {}};
    } else if ((i >= earlier && decision.reason.empty()) ||
               (decision.accepted && problem.state.connects(problem.loops[i]))) {
      decision = {false, kDisagreesWithMap};
    }
  }
}

}  // namespace

Alignment refine_alignment(const Alignment& start, const std::vector<AlignmentSession>& sessions,
                           std::span<const LoopConstraint> loops, const MergeConfig& config) {
  const std::size_t earlier = start.decisions.size();
  if (earlier > loops.size()) throw std::invalid_argument("refinement needs all earlier loops");
  AlignmentProblem problem(sessions, loops, config);
  start_from(start, problem);
  const auto connected = problem.state.connected_sessions();
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < problem.loops.size(); ++i) {
    if (!problem.state.connects(problem.loops[i])) continue;
    if (i >= earlier || problem.decisions[i].accepted) chosen.push_back(i);
  }
  let_unconfirmed_wait(problem, earlier, chosen);
  MapState refined = problem.state;
  bool solved = problem.optimize_rejecting_outliers(refined, connected, chosen);
  if (solved && readmit(problem, refined, chosen)) {
    solved = problem.optimize_rejecting_outliers(refined, connected, chosen);
  }
  if (solved && problem.all_plausible(refined, connected)) {
    adopt(std::move(refined), chosen, earlier, problem);
  } else {
    for (std::size_t i = earlier; i < problem.loops.size(); ++i) {
      problem.decisions[i] = {false, solved ? kImplausibleDeformation : kNoSolution};
    }
  }
  return problem.result();
}

}  // namespace unimapper::merge
