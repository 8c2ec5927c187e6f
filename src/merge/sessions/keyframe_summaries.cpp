#include "keyframe_summaries.hpp"

#include <algorithm>
#include <iterator>

namespace unimapper::merge {
namespace {

constexpr double kReachM = 50.0;

/// A robot may stand on a thin link for hours.
constexpr std::size_t kMostAway = 64;

void append_cells(const KeyframeRecord& from, const KeyframeRecord& to,
                  std::vector<FineCell>& cells) {
  const Pose T_to_from = to.T_odometry_keyframe.inverse() * from.T_odometry_keyframe;
  if (T_to_from.translation.norm() > kReachM) return;
  const Eigen::Matrix3f rotation = T_to_from.rotation.cast<float>();
  const Eigen::Vector3f translation = T_to_from.translation.cast<float>();
  for (FineCell cell : from.static_cells) {
    cell.position = (rotation * cell.position + translation).eval();
    cells.push_back(cell);
  }
}

}  // namespace

void include_summaries(SessionData& session) {
  std::move(session.summaries.begin(), session.summaries.end(),
            std::back_inserter(session.keyframes));
  session.summaries.clear();
  std::sort(session.keyframes.begin(), session.keyframes.end(),
            [](const auto& a, const auto& b) { return a.sequence < b.sequence; });
}

std::vector<std::size_t> whole_neighbours(std::span<const KeyframeRecord> keyframes, std::size_t k,
                                          std::size_t count) {
  std::vector<std::size_t> found;
  std::size_t before = 0;
  std::size_t after = 0;
  for (std::size_t away = 1; away <= kMostAway; ++away) {
    if (before < count && k >= away && !keyframes[k - away].is_summary) {
      found.push_back(k - away);
      ++before;
    }
    if (after < count && k + away < keyframes.size() && !keyframes[k + away].is_summary) {
      found.push_back(k + away);
      ++after;
    }
  }
  return found;
}

std::vector<FineCell> neighbouring_cells(const SessionData& session, std::size_t k) {
  std::vector<FineCell> cells;
  for (const std::size_t i : whole_neighbours(session.keyframes, k, 1)) {
    append_cells(*whole_keyframe(session, i), session.keyframes[k], cells);
  }
  return cells;
}

}  // namespace unimapper::merge
