#include "unimapper/merge/keyframe_summaries.hpp"

#include <algorithm>
#include <iterator>

namespace unimapper::merge {
namespace {

constexpr double kReachM = 50.0;

/// False, and nothing added, beyond the reach; true once the cells of a whole keyframe were added.
bool add_cells(const KeyframeRecord& from, const KeyframeRecord& to, std::vector<FineCell>& cells) {
  const Pose T_to_from = to.T_odometry_keyframe.inverse() * from.T_odometry_keyframe;
  if (from.is_summary || T_to_from.translation.norm() > kReachM) return false;
  const Eigen::Matrix3f rotation = T_to_from.rotation.cast<float>();
  const Eigen::Vector3f translation = T_to_from.translation.cast<float>();
  for (FineCell cell : from.static_cells) {
    cell.position = (rotation * cell.position + translation).eval();
    cells.push_back(cell);
  }
  return true;
}

}  // namespace

std::size_t include_summaries(SessionData& session) {
  const std::size_t count = session.summaries.size();
  std::move(session.summaries.begin(), session.summaries.end(),
            std::back_inserter(session.keyframes));
  session.summaries.clear();
  std::sort(session.keyframes.begin(), session.keyframes.end(),
            [](const auto& a, const auto& b) { return a.sequence < b.sequence; });
  return count;
}

std::vector<FineCell> neighbouring_cells(std::span<const KeyframeRecord> keyframes, std::size_t k) {
  std::vector<FineCell> cells;
  for (std::size_t i = k; i > 0; --i) {
    if (add_cells(keyframes[i - 1], keyframes[k], cells)) break;
  }
  for (std::size_t i = k + 1; i < keyframes.size(); ++i) {
    if (add_cells(keyframes[i], keyframes[k], cells)) break;
  }
  return cells;
}

}  // namespace unimapper::merge
