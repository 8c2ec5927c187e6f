// Structure of one keyframe in the free space of another.
#include "free_space_conflict.hpp"

#include <algorithm>

#include "src/merge/sessions/keyframe_free_space.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::merge {
namespace {

constexpr float kContradictionRangeM = 25.0F;

/// One direction: how `observer` sees the structure of `source`.
CommonView seen_by(const KeyframeRecord& observer, const RegistrationCloud& source,
                   const Pose& T_observer_source) {
  const Eigen::Matrix3f r = T_observer_source.rotation.cast<float>();
  const Eigen::Vector3f t = T_observer_source.translation.cast<float>();
  PointEvidence structure;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source.is_ground(i)) continue;
    const Eigen::Vector3f p = r * source.points()[i] + t;
    if (p.squaredNorm() > kContradictionRangeM * kContradictionRangeM) continue;
    structure.push_back(p);
  }
  const VisibilityTest visibility(kFreeMarginM, EvidenceDefaults::kRangeMarginRelative);
  const KeyframeFreeSpace space(observer, WithoutImages::kPaintFromCells);
  space.observe(visibility, EvidenceWeights{}, Pose{}, structure.points());
  CommonView view;
  std::size_t seen_through = 0;
  for (const std::int32_t log_odds : structure.log_odds()) {
    seen_through += log_odds > 0 ? 1 : 0;
    view.observed += log_odds != 0 ? 1 : 0;
  }
  if (view.is_enough()) {
    view.contradiction = static_cast<double>(seen_through) / static_cast<double>(view.observed);
  }
  return view;
}

}  // namespace

CommonView common_view(const KeyframeClouds& clouds, KeyframeId match, KeyframeId query,
                       const Pose& T_match_query) {
  const CommonView by_match = seen_by(*clouds.whole(match), *clouds.cloud(query), T_match_query);
  const CommonView by_query =
      seen_by(*clouds.whole(query), *clouds.cloud(match), T_match_query.inverse());
  return {std::max(by_match.observed, by_query.observed),
          std::max(by_match.contradiction, by_query.contradiction)};
}

}  // namespace unimapper::merge
