// Suitability of each session as the central map.
#include "central_score.hpp"

#include <algorithm>
#include <span>

#include "keyframe_free_space.hpp"
#include "src/core/quantile.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {
namespace {

constexpr float kInverseFiveMetres = 0.2F;

struct Qualities {
  double coverage = 0.0;
  double loops = 0.0;
  double field_of_view = 0.0;
  double richness = 0.0;
};

/// Distinct cells of 10 m by 10 m that hold static structure.
double covered_cells(const SessionData& session) {
  VoxelTable cells;
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    VoxelTable own;
    const auto keyframe = whole_keyframe(session, k);
    for (const auto& cell : keyframe->static_cells) {
      own.find_or_insert(pack(voxel_index(cell.position, kInverseFiveMetres)));
    }
    for (std::uint32_t i = 0; i < own.size(); ++i) {
      const VoxelIndex v = unpack(own.key(i));
      const Eigen::Vector3d center(5.0 * v.x + 2.5, 5.0 * v.y + 2.5, 5.0 * v.z + 2.5);
      const Eigen::Vector3d p = keyframe->T_odometry_keyframe * center;
      const Eigen::Vector3f flat(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
      const VoxelIndex cell = voxel_index(flat, 0.1F);
      if (is_representable(cell)) cells.find_or_insert(pack(cell));
    }
  }
  return static_cast<double>(cells.size());
}

/// Share of keyframes that lie between the two ends of a verified loop.
double share_in_loops(const SessionData& session, std::size_t index,
                      const std::vector<LoopConstraint>& intra_session_loops) {
  std::vector<bool> inside(session.keyframes.size(), false);
  for (const auto& loop : intra_session_loops) {
    if (!loop.decision.accepted || loop.query.session != index) continue;
    const auto [first, last] = std::minmax(loop.query.keyframe, loop.match.keyframe);
    std::fill(inside.begin() + static_cast<std::ptrdiff_t>(first),
              inside.begin() + static_cast<std::ptrdiff_t>(last) + 1, true);
  }
  const auto count = std::count(inside.begin(), inside.end(), true);
  return static_cast<double>(count) / static_cast<double>(inside.size());
}

Qualities qualities(const SessionData& session, std::size_t index,
                    const std::vector<LoopConstraint>& intra_session_loops) {
  Qualities q;
  if (session.keyframes.empty()) return q;
  q.coverage = covered_cells(session);
  q.loops = share_in_loops(session, index, intra_session_loops);
  const std::size_t step = std::max<std::size_t>(1, session.keyframes.size() / 10);
  std::vector<double> views;
  std::vector<std::size_t> keypoints;
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    keypoints.push_back(session.keyframes[k].keypoints.size());
    if (k % step != 0) continue;
    const KeyframeFreeSpace space(*whole_keyframe(session, k), WithoutImages::kPaintFromCells);
    views.push_back(space.field_of_view());
  }
  q.field_of_view = median(std::span(views));
  q.richness = static_cast<double>(median(std::span(keypoints)));
  return q;
}

}  // namespace

std::vector<double> central_scores(const std::vector<SessionData>& sessions,
                                   const std::vector<LoopConstraint>& intra_session_loops) {
  std::vector<Qualities> all;
  Qualities best{1e-9, 1e-9, 1e-9, 1e-9};
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const Qualities q = qualities(sessions[s], s, intra_session_loops);
    best.coverage = std::max(best.coverage, q.coverage);
    best.loops = std::max(best.loops, q.loops);
    best.field_of_view = std::max(best.field_of_view, q.field_of_view);
    best.richness = std::max(best.richness, q.richness);
    all.push_back(q);
  }
  std::vector<double> scores;
  scores.reserve(all.size());
  for (const Qualities& q : all) {
    scores.push_back(0.35 * q.coverage / best.coverage + 0.25 * q.loops / best.loops +
                     0.20 * q.field_of_view / best.field_of_view +
                     0.20 * q.richness / best.richness);
  }
  return scores;
}

}  // namespace unimapper::merge
