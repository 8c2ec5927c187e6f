// Structure of one keyframe in the free space of another.
#include "free_space_conflict.hpp"

#include <algorithm>

#include "keyframe_free_space.hpp"

namespace unimapper::merge {
namespace {

constexpr float kContradictionRangeM = 25.0F;
constexpr std::size_t kFewestObserved = 50;  ///< points without which nothing is contradicted

/// Share of `source`'s structure that the keyframe `observer` saw through, of all it observed.
double contradiction(const KeyframeRecord& observer, const RegistrationCloud& source,
                     const Pose& T_observer_source, const MergeConfig& config) {
  const Eigen::Matrix3f r = T_observer_source.rotation.cast<float>();
  const Eigen::Vector3f t = T_observer_source.translation.cast<float>();
  PointEvidence structure;
  for (std::size_t i = 0; i < source.size(); ++i) {
    if (source.is_ground(i)) continue;
    const Eigen::Vector3f p = r * source.points()[i] + t;
    if (p.squaredNorm() > kContradictionRangeM * kContradictionRangeM) continue;
    structure.push_back(p);
  }
  const RefinementConfig& evidence = config.refinement;
  const VisibilityTest visibility(config.map.free_margin_m, evidence.range_margin_relative);
  const KeyframeFreeSpace space(observer, WithoutImages::kPaintFromCells);
  space.observe(visibility, EvidenceWeights::of(evidence), Pose{}, structure.points());
  std::size_t free = 0;
  std::size_t observed = 0;
  for (const std::int32_t log_odds : structure.log_odds()) {
    free += log_odds > 0 ? 1 : 0;
    observed += log_odds != 0 ? 1 : 0;
  }
  return observed < kFewestObserved ? 0.0
                                    : static_cast<double>(free) / static_cast<double>(observed);
}

}  // namespace

double structure_in_free_space(const KeyframeClouds& clouds, KeyframeId match, KeyframeId query,
                               const Pose& T_match_query, const MergeConfig& config) {
  return std::max(
      contradiction(*clouds.whole(match), *clouds.cloud(query), T_match_query, config),
      contradiction(*clouds.whole(query), *clouds.cloud(match), T_match_query.inverse(), config));
}

}  // namespace unimapper::merge
