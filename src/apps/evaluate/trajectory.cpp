// `unimapper evaluate trajectory`: absolute trajectory error of merged sessions.
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/evaluate/map_alignment.hpp"

namespace unimapper::apps {

std::string evaluate_trajectory(const EvaluateTrajectoryOptions& options) {
  const std::vector<PairedSession> sessions = pair_sessions(options.map, options.truths);
  const evaluate::Alignment alignment = align_central(sessions);
  std::vector<SessionTrajectory> results;
  for (const PairedSession& session : sessions) {
    results.push_back({session.name, session.status, {}, session.estimate.size()});
    if (session.pairs.empty()) continue;
    results.back().error = evaluate::trajectory_error(session.pairs, alignment.T_truth_estimate);
  }
  return trajectory_json(results, alignment);
}

}  // namespace unimapper::apps
