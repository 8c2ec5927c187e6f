// Structure that stood during one visit of a place and not during another
#include "changed_structure.hpp"

#include <algorithm>
#include <vector>

#include "src/merge/sessions/keyframe_free_space.hpp"
#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::merge {
namespace {

constexpr float kComparedWithinM = 15.0F;
constexpr float kNearStructureM = 0.3F;
// Keyframes of the other visit on either side: farther ones are placed by odometry alone. More of
// its own: what stood there for a moment is told by going on.
constexpr std::size_t kOfOther = 2;
constexpr std::size_t kOfOwn = 3;
constexpr std::uint32_t kFewestThrough = 2;
constexpr std::size_t kFewestObserved = 200;

/// Keyframes that saw through a point, and those that saw a surface there.
struct Seen {
  std::uint32_t through = 0;
  std::uint32_t surface = 0;
};

class Observers {
 public:
  explicit Observers(const KeyframeClouds& clouds)
      : clouds_(clouds), visibility_(kFreeMarginM, EvidenceDefaults::kRangeMarginRelative) {}

  /// What keyframes `chosen` of a visit saw of points in the frame of the keyframe it is about.
  [[nodiscard]] std::vector<Seen> ask(const Visit& about, const std::vector<std::size_t>& chosen,
                                      const std::vector<Eigen::Vector3f>& points) const {
    std::vector<Seen> seen(points.size());
    PointEvidence evidence;
    for (const Eigen::Vector3f& p : points) evidence.push_back(p);
    const auto& poses = about.T_session_keyframe;
    for (const std::size_t k : chosen) {
      evidence.clear_log_odds();
      const KeyframeFreeSpace space(*clouds_.whole({about.keyframe.session, k}),
                                    WithoutImages::kPaintFromCells);
      space.observe(visibility_, weights_, poses[k].inverse() * poses[about.keyframe.keyframe],
                    evidence.points());
      for (std::size_t i = 0; i < points.size(); ++i) {
        seen[i].through += evidence.log_odds(i) > 0 ? 1 : 0;
        seen[i].surface += evidence.log_odds(i) < 0 ? 1 : 0;
      }
    }
    return seen;
  }

 private:
  const KeyframeClouds& clouds_;
  VisibilityTest visibility_;
  EvidenceWeights weights_;
};

/// Of the visit, up to `most` before and after the keyframe that it is about.
std::vector<std::size_t> keyframes_beside(const Visit& visit, std::size_t most) {
  const std::size_t at = visit.keyframe.keyframe;
  const std::size_t end = std::min(at + most + 1, visit.T_session_keyframe.size());
  std::vector<std::size_t> chosen;
  for (std::size_t k = at - std::min(at, most); k < end; ++k) chosen.push_back(k);
  return chosen;
}

/// The structure of `source`, as `other` saw it.
std::optional<double> share_changed_for(const KeyframeClouds& clouds, const Visit& other,
                                        const Visit& source, const Pose& T_other_source) {
  const auto cloud = clouds.cloud(source.keyframe);
  const auto structure = clouds.cloud(other.keyframe);
  const Eigen::Matrix3f r = T_other_source.rotation.cast<float>();
  const Eigen::Vector3f t = T_other_source.translation.cast<float>();
  std::vector<Eigen::Vector3f> own;
  std::vector<Eigen::Vector3f> there;
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const Eigen::Vector3f& p = cloud->points()[i];
    const Eigen::Vector3f moved = r * p + t;
    if (cloud->is_ground(i) || p.norm() > kComparedWithinM || moved.norm() > kComparedWithinM)
      continue;
    own.push_back(p);
    there.push_back(moved);
  }
  const Observers observers(clouds);
  const std::vector<Seen> by_other = observers.ask(other, keyframes_beside(other, kOfOther), there);
  const std::vector<Seen> by_own = observers.ask(source, keyframes_beside(source, kOfOwn), own);
  std::size_t observed = 0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Seen& seen = by_other[i];
    if (seen.through + seen.surface < kFewestThrough) continue;
    ++observed;
    const bool is_free = seen.through >= kFewestThrough && seen.through > 2 * seen.surface;
    const bool stood = 2 * by_own[i].through < by_own[i].surface;
    if (!is_free || !stood) continue;
    float gate = kNearStructureM * kNearStructureM;
    const std::uint32_t nearest = structure->nearest(there[i], gate);
    const bool is_near = nearest != RegistrationCloud::kNone && !structure->is_ground(nearest);
    changed += is_near ? 0 : 1;
  }
  if (observed < kFewestObserved) return std::nullopt;
  return static_cast<double>(changed) / static_cast<double>(observed);
}

}  // namespace

std::optional<double> changed_share(const KeyframeClouds& clouds, const Visit& match,
                                    const Visit& query, const Pose& T_match_query) {
  // An empty one is less than any share.
  return std::max(share_changed_for(clouds, match, query, T_match_query),
                  share_changed_for(clouds, query, match, T_match_query.inverse()));
}

}  // namespace unimapper::merge
