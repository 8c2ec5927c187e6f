// JSON documents of the evaluations.
//
// Separate because the JSON library is slow to compile.
#pragma once

#include <string>
#include <vector>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/evaluate/changed_objects.hpp"
#include "src/evaluate/dynamic.hpp"
#include "src/evaluate/loops.hpp"
#include "src/evaluate/map_quality.hpp"
#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::apps {

/// Result of one session of `evaluate trajectory`; no error for unconnected sessions.
struct SessionTrajectory {
  std::string name;
  std::string status;
  std::optional<evaluate::TrajectoryError> error;
  std::size_t poses = 0;  ///< of the estimate, paired or not
};

/// Result of one pair of sessions of `evaluate map`.
struct SessionPair {
  std::string first;
  std::string second;
  evaluate::CloudAgreement agreement;
};

std::string dynamic_json(const EvaluateDynamicOptions& options, std::size_t scans,
                         const evaluate::DynamicScore& points, const evaluate::MotionScore& motion,
                         const std::optional<evaluate::SinceMotionScore>& since_motion,
                         const evaluate::BenchmarkScore& benchmark);
std::string loops_json(const EvaluateLoopsOptions& options, const evaluate::LoopScore& score);
std::string trajectory_json(const std::vector<SessionTrajectory>& sessions,
                            const evaluate::Alignment& alignment);
std::string map_json(const EvaluateMapOptions& options, const std::vector<SessionPair>& pairs,
                     const evaluate::MapEntropy& entropy, std::size_t points);

std::string changes_json(const std::vector<evaluate::FoundChange>& found,
                         const std::vector<evaluate::TrueChange>& truth,
                         const evaluate::ChangeScore& score);

/// A changed object as changes.json has it.
struct ReportedChange {
  std::string session;  ///< in which the object exists
  std::string free_in;  ///< that saw through its place
  ChangeKind change = ChangeKind::kAppeared;
  UprightBox box;  ///< map frame
};
/// Changed objects of a map folder. Throws std::runtime_error naming the file and what is wrong
/// with it.
std::vector<ReportedChange> read_changes(const std::filesystem::path& map);

/// Sessions of a map folder as its summary.json lists them.
struct SummarySession {
  std::string name;
  std::string status;  ///< "central", "merged" or "unconnected"
  /// Of the map's points, in the frame of the session's trajectory, metres.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};
/// Throws std::runtime_error naming the file and what is wrong with it.
std::vector<SummarySession> read_summary(const std::filesystem::path& map);

}  // namespace unimapper::apps
