// Optimisation with outlier rejection, shared by joining and refinement.
#include "alignment_problem.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "site_frame.hpp"

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

void check_position(const KnownPosition& position, std::size_t session,
                    const AlignmentSession& of) {
  const bool is_of_it = position.keyframe.session == session &&
                        position.keyframe.keyframe < of.T_odometry_keyframe.size();
  if (!is_of_it) throw std::invalid_argument("position of a keyframe that does not exist");
}

}  // namespace

AlignmentProblem::AlignmentProblem(const std::vector<AlignmentSession>& all_sessions,
                                   std::span<const LoopConstraint> all_loops,
                                   const MergeConfig& merge_config)
    : config(merge_config), sessions(all_sessions) {
  std::vector<SessionPath> odometry;
  odometry.reserve(sessions.size());
  for (const auto& session : sessions) {
    odometry.emplace_back(session.T_odometry_keyframe, config.odometry, session.slips);
  }
  state = make_map_state(std::move(odometry));
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    state.up[s] = sessions[s].up;
    for (const auto& position : sessions[s].positions) check_position(position, s, sessions[s]);
  }
  sites.resize(sessions.size());
  loops.reserve(all_loops.size());
  for (const auto& loop : all_loops) {
    check_loop(loop, sessions);
    loops.push_back(loop.query.session < loop.match.session ? flipped(loop) : loop);
  }
  decisions.resize(loops.size());
  reasons.resize(sessions.size());
  drift_scale.assign(sessions.size(), 1.0);
}

void AlignmentProblem::set_drift(std::size_t session, double scale) {
  drift_scale[session] = scale;
  state.odometry[session] =
      SessionPath(sessions[session].T_odometry_keyframe, config.odometry, sessions[session].slips)
          .with_drift(scale);
}

std::vector<LoopConstraint> AlignmentProblem::select(std::span<const std::size_t> indices) const {
  std::vector<LoopConstraint> chosen;
  chosen.reserve(indices.size());
  for (const std::size_t i : indices) chosen.push_back(loops[i]);
  return chosen;
}

bool AlignmentProblem::optimize_rejecting_outliers(MapState& trial,
                                                   std::span<const std::size_t> which_sessions,
                                                   std::vector<std::size_t>& chosen,
                                                   Variables variables) const {
  for (int round = 0; round < kMaxRejectionRounds; ++round) {
    if (!optimize_maps(trial, which_sessions, select(chosen), config.graph, variables)) {
      return false;
    }
    const auto is_outlier = [&](std::size_t i) {
      return !loops[i].by_person && loop_chi2(trial, loops[i]) > config.acceptance.loop_chi2;
    };
    const auto is_wrong = [&](const KnownPosition& position) {
      const std::size_t s = position.keyframe.session;
      return std::find(which_sessions.begin(), which_sessions.end(), s) != which_sessions.end() &&
             position_chi2(position, position_residual(trial, position)) > kPositionChi2;
    };
    const std::size_t removed =
        std::erase_if(chosen, is_outlier) + std::erase_if(trial.positions, is_wrong);
    if (removed == 0) break;
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
  alignment.positions = position_outcomes();
  alignment.drift_scale = drift_scale;
  const auto used = positions_of(state, state.connected_sessions());
  if (!used.empty() && state.T_map_site) {
    alignment.T_map_site = state.T_map_site;
    alignment.heading_information = fit_site(state, used).heading_information;
  }
  return alignment;
}

std::vector<PositionOutcome> AlignmentProblem::position_outcomes() const {
  std::vector<PositionOutcome> outcomes;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    for (const KnownPosition& position : sessions[s].positions) {
      const auto is_it = [&](const KnownPosition& other) {
        return other.keyframe == position.keyframe;
      };
      const auto why = std::find_if(rejected.begin(), rejected.end(),
                                    [&](const auto& other) { return is_it(other.given); });
      const bool is_in_use = std::any_of(state.positions.begin(), state.positions.end(), is_it);
      PositionOutcome& outcome = outcomes.emplace_back();
      outcome.given = position;
      outcome.used = is_in_use && state.connected[s] && state.T_map_site;
      outcome.residual_m.setZero();
      if (outcome.used) {
        outcome.residual_m = position_residual(state, position);
      } else if (why != rejected.end()) {
        outcome = *why;
      } else {
        outcome.reason = is_in_use ? "its session is not in the map" : kDisagreesWithMap;
      }
    }
  }
  return outcomes;
}

}  // namespace unimapper::merge
