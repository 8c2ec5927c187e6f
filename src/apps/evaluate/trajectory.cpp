// `unimapper evaluate trajectory`: absolute trajectory error of merged sessions.
#include <algorithm>
#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/truth.hpp"

namespace unimapper::apps {
namespace {

using evaluate::PosePair;
using evaluate::StampedPose;

std::vector<StampedPose> read_estimate(const std::filesystem::path& map,
                                       const std::string& session) {
  const std::filesystem::path file = map / "trajectories" / (session + ".tum");
  const datasets::Trajectory trajectory =
      datasets::parse_trajectory(datasets::read_file(file), file);
  if (trajectory.stamps_ns.empty() && !trajectory.poses.empty()) {
    throw std::runtime_error(file.string() + ": has no time stamps; TUM lines have 8 columns");
  }
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    poses.push_back({trajectory.stamps_ns[i], trajectory.poses[i]});
  }
  return poses;
}

const SummarySession& find_session(const std::vector<SummarySession>& sessions,
                                   const std::string& name) {
  const auto found = std::find_if(sessions.begin(), sessions.end(),
                                  [&](const SummarySession& s) { return s.name == name; });
  if (found != sessions.end()) return *found;
  std::string known;
  for (const SummarySession& session : sessions) {
    known += (known.empty() ? "" : ", ") + session.name;
  }
  throw std::runtime_error("the map has no session \"" + name + "\"; it has: " + known);
}

std::vector<PosePair> pair_up(const std::filesystem::path& map, const std::string& session,
                              const std::filesystem::path& truth, std::size_t& poses) {
  const std::vector<StampedPose> estimate = read_estimate(map, session);
  poses = estimate.size();
  auto pairs = evaluate::associate(estimate, read_truth(truth));
  if (pairs.empty()) {
    throw std::runtime_error("session \"" + session + "\" and " + truth.string() +
                             " have no two stamps within 10 ms; is it the right dataset?");
  }
  return pairs;
}

}  // namespace

std::string evaluate_trajectory(const EvaluateTrajectoryOptions& options) {
  const std::vector<SummarySession> sessions = read_summary(options.map);
  std::vector<SessionTrajectory> results;
  std::vector<std::vector<PosePair>> pairs;
  const std::vector<PosePair>* central = nullptr;
  pairs.reserve(options.truths.size());
  for (const auto& [name, truth] : options.truths) {
    const SummarySession& session = find_session(sessions, name);
    results.push_back({session.name, session.status, {}, 0});
    pairs.emplace_back();
    if (session.status == "unconnected") continue;
    pairs.back() = pair_up(options.map, name, truth, results.back().poses);
    if (session.status == "central") central = &pairs.back();
  }
  if (central == nullptr) {
    throw std::runtime_error(
        "the central session's frame is what gets aligned: give its --truth SESSION=DATASET too");
  }
  const evaluate::Alignment alignment = evaluate::align(*central);
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (pairs[i].empty()) continue;
    results[i].error = evaluate::trajectory_error(pairs[i], alignment.T_truth_estimate);
  }
  return trajectory_json(results, alignment);
}

}  // namespace unimapper::apps
