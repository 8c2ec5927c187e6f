#include "src/apps/evaluate/map_alignment.hpp"

#include <algorithm>
#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/truth.hpp"

namespace unimapper::apps {
namespace {

using evaluate::PosePair;
using evaluate::StampedPose;

/// In the frame of the map's points.
std::vector<StampedPose> read_estimate(const std::filesystem::path& map,
                                       const SummarySession& session) {
  const std::filesystem::path file = map / "trajectories" / (session.name + ".tum");
  const datasets::Trajectory trajectory =
      datasets::parse_trajectory(datasets::read_text(file), file);
  if (trajectory.stamps_ns.empty() && !trajectory.poses.empty()) {
    throw std::runtime_error(file.string() + ": has no time stamps; TUM lines have 8 columns");
  }
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    poses.push_back({trajectory.stamps_ns[i], trajectory.poses[i]});
    poses.back().T_world_sensor.translation -= session.origin;
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

std::vector<PosePair> pair_up(const PairedSession& session, const std::filesystem::path& truth) {
  auto pairs = evaluate::associate(session.estimate, session.truth);
  if (pairs.empty()) {
    throw std::runtime_error("session \"" + session.name + "\" and " + truth.string() +
                             " have no two stamps within 10 ms; is it the right dataset?");
  }
  return pairs;
}

}  // namespace

std::vector<PairedSession> pair_sessions(const std::filesystem::path& map,
                                         const SessionTruths& truths) {
  const std::vector<SummarySession> sessions = read_summary(map);
  std::vector<PairedSession> paired;
  for (const auto& [name, truth] : truths) {
    const SummarySession& found = find_session(sessions, name);
    PairedSession& session = paired.emplace_back();
    session.name = found.name;
    session.status = found.status;
    session.truth = read_truth(truth);
    if (found.status != "central" && found.status != "merged") continue;
    session.estimate = read_estimate(map, found);
    session.pairs = pair_up(session, truth);
  }
  return paired;
}

evaluate::Alignment align_central(const std::vector<PairedSession>& sessions) {
  const auto central = std::find_if(sessions.begin(), sessions.end(),
                                    [](const auto& s) { return s.status == "central"; });
  if (central == sessions.end()) {
    throw std::runtime_error(
        "the central session's frame is what gets aligned: give its --truth SESSION=DATASET too");
  }
  return evaluate::align(central->pairs);
}

}  // namespace unimapper::apps
