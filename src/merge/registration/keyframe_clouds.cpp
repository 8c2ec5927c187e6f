// Registration clouds of keyframes and their neighbours (local submaps).
#include "keyframe_clouds.hpp"

#include <algorithm>
#include <atomic>

#include "src/merge/parallel.hpp"
#include "src/merge/sessions/keyframe_summaries.hpp"

namespace unimapper::merge {
namespace {

/// A keyframe's cloud with so many cells takes no further neighbours.
constexpr std::size_t kSubmapCells = 60000;
/// Points farther from the keyframe are left out, metres.
constexpr float kSubmapRadiusM = 50.0F;

}  // namespace

Submap submap_of(const SessionData& session, std::size_t k) {
  const auto& keyframes = session.keyframes;
  const Pose T_keyframe_odometry = keyframes[k].T_odometry_keyframe.inverse();
  const float reach = kSubmapRadiusM * kSubmapRadiusM;
  Submap submap;
  const auto add = [&](std::size_t i) {
    const Pose T = T_keyframe_odometry * keyframes[i].T_odometry_keyframe;
    const Eigen::Matrix3f rotation = T.rotation.cast<float>();
    const Eigen::Vector3f translation = T.translation.cast<float>();
    const auto keyframe = whole_keyframe(session, i);
    submap.points.reserve(submap.points.size() + keyframe->static_cells.size());
    submap.ground.reserve(submap.ground.size() + keyframe->static_cells.size());
    for (const auto& cell : keyframe->static_cells) {
      const Eigen::Vector3f p = rotation * cell.position + translation;
      if (!(p.squaredNorm() < reach)) continue;
      submap.points.push_back(p);
      submap.ground.push_back(cell.ground);
    }
    submap.keyframes.push_back(i);
  };
  add(k);
  std::size_t last_away = 0;
  for (const std::size_t i : whole_neighbours(keyframes, k, kSubmapKeyframes)) {
    const std::size_t away = i < k ? k - i : i - k;
    // Both of two as near, or neither.
    if (away != last_away && submap.points.size() >= kSubmapCells) break;
    last_away = away;
    add(i);
  }
  return submap;
}

KeyframeClouds::KeyframeClouds(const std::vector<SessionData>& sessions,
                               const RegistrationConfig& config, unsigned threads,
                               std::uint64_t max_bytes)
    : sessions_(sessions),
      config_(config),
      threads_(threads),
      forgotten_(sessions.size(), 0),
      clouds_(max_bytes) {}

KeyframeId KeyframeClouds::key(KeyframeId k) const {
  return {k.session, forgotten_[k.session] + k.keyframe};
}

void KeyframeClouds::forget_first(std::size_t session, std::size_t count) {
  forgotten_[session] += count;
  clouds_.forget_if([&](const KeyframeId& of) {
    return of.session == session && of.keyframe < forgotten_[session];
  });
}

void KeyframeClouds::forget_from(std::size_t session, std::size_t keyframe) {
  if (session >= forgotten_.size()) forgotten_.resize(session + 1, 0);
  const KeyframeId first = key({session, keyframe});
  clouds_.forget_if(
      [&](const KeyframeId& of) { return of.session == session && of.keyframe >= first.keyframe; });
}

void KeyframeClouds::prepare(std::vector<KeyframeId> keyframes) {
  std::sort(keyframes.begin(), keyframes.end());
  keyframes.erase(std::unique(keyframes.begin(), keyframes.end()), keyframes.end());
  std::atomic<std::uint64_t> bytes{0};
  parallel_for(keyframes.size(), threads_, [&](std::size_t i) {
    if (bytes < clouds_.max_bytes() / 2) bytes += cloud(keyframes[i])->bytes();
  });
}

std::shared_ptr<const RegistrationCloud> KeyframeClouds::cloud(KeyframeId k) const {
  return clouds_.get(
      key(k), [&](const KeyframeId&) { return make_cloud(k); },
      [](const RegistrationCloud& cloud) { return cloud.bytes(); });
}

RegistrationCloud KeyframeClouds::make_cloud(KeyframeId k) const {
  const Submap submap = submap_of(sessions_[k.session], k.keyframe);
  return RegistrationCloud(submap.points, submap.ground, config_);
}

}  // namespace unimapper::merge
