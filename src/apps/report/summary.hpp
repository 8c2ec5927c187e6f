// Figures of a merge.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/apps/report.hpp"
#include "src/apps/report/run_stats.hpp"

namespace unimapper::apps {

/// One session in figures.
struct SessionSummary {
  std::string name;
  std::string sensor;
  merge::SessionStatus status = merge::SessionStatus::kUnconnected;
  std::string reason;  ///< why it is not connected
  std::size_t keyframes = 0;
  std::size_t up_known = 0;               ///< keyframes that know up
  std::size_t odometry_contradicted = 0;  ///< keyframes whose scans contradict the odometry
  std::uint64_t missing = 0;
  std::uint64_t damaged = 0;
  bool complete = false;
  std::uint64_t points_in = 0;
  double dynamic_share = 0.0;  ///< of the points that went in, [0, 1]
  double path_m = 0.0;         ///< along the keyframes
  std::optional<evaluate::TrajectoryError> error;
  /// Distance travelled and translation error of every scan with a known truth, metres.
  std::vector<std::pair<double, double>> error_along_path_m;
  std::vector<Eigen::Vector3d> truth_in_map;  ///< true positions, map frame
  std::optional<RunStats> stats;
};

/// Loops of one pair of sessions, or within one.
struct LoopCount {
  std::size_t accepted = 0;
  std::size_t refused = 0;
};

struct Summary {
  std::vector<SessionSummary> sessions;
  std::size_t merged_sessions = 0;  ///< including the central one
  /// Key: the two sessions' indices, smaller first.
  std::map<std::pair<std::size_t, std::size_t>, LoopCount> loops_by_pair;
  std::map<std::string, std::size_t> refusals;         ///< reason without figures, loops
  std::map<std::string, std::size_t> acceptance_ways;  ///< how accepted loops were found, loops
  LoopCount intra;
  LoopCount inter;
  bool has_truth = false;  ///< of the central session at least
};

/// Works the figures out. Trajectory errors need the central session's truth: its frame is
/// aligned once, the others are not aligned on their own.
[[nodiscard]] Summary summarize(const ReportInput& input);

}  // namespace unimapper::apps
