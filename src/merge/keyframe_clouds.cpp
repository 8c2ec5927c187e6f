// Registration clouds of keyframes and their neighbours (local submaps).
#include "keyframe_clouds.hpp"

#include <algorithm>

#include "parallel.hpp"
#include "unimapper/merge/keyframe_summaries.hpp"

namespace unimapper::merge {

KeyframeClouds::KeyframeClouds(const std::vector<SessionData>& sessions,
                               const RegistrationConfig& config, unsigned threads)
    : sessions_(sessions), config_(config), threads_(threads) {
  for (const auto& session : sessions) {
    clouds_.emplace_back(session.keyframes.size());
  }
}

void KeyframeClouds::forget_first(std::size_t session, std::size_t count) {
  auto& clouds = clouds_[session];
  clouds.erase(clouds.begin(),
               clouds.begin() + static_cast<std::ptrdiff_t>(std::min(count, clouds.size())));
}

void KeyframeClouds::prepare(std::vector<KeyframeId> keyframes) {
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    if (clouds_[s].size() < sessions_[s].keyframes.size()) {
      clouds_[s].resize(sessions_[s].keyframes.size());
    }
  }
  std::sort(keyframes.begin(), keyframes.end());
  keyframes.erase(std::unique(keyframes.begin(), keyframes.end()), keyframes.end());
  std::erase_if(keyframes, [&](KeyframeId k) { return clouds_[k.session][k.keyframe] != nullptr; });
  parallel_for(keyframes.size(), threads_, [&](std::size_t i) {
    const KeyframeId k = keyframes[i];
    clouds_[k.session][k.keyframe] = std::make_unique<RegistrationCloud>(make_cloud(k));
  });
}

RegistrationCloud KeyframeClouds::make_cloud(KeyframeId k) const {
  const auto& keyframes = sessions_[k.session].keyframes;
  const Pose T_keyframe_odometry = keyframes[k.keyframe].T_odometry_keyframe.inverse();
  const float reach = config_.submap_radius_m * config_.submap_radius_m;
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint8_t> ground;
  const auto add = [&](std::size_t i) {
    const Pose T = T_keyframe_odometry * keyframes[i].T_odometry_keyframe;
    const Eigen::Matrix3f rotation = T.rotation.cast<float>();
    const Eigen::Vector3f translation = T.translation.cast<float>();
    for (const auto& cell : keyframes[i].static_cells) {
      const Eigen::Vector3f p = rotation * cell.position + translation;
      if (!(p.squaredNorm() < reach)) continue;
      points.push_back(p);
      ground.push_back(cell.ground);
    }
  };
  add(k.keyframe);
  std::size_t last_away = 0;
  for (const std::size_t i : whole_neighbours(keyframes, k.keyframe, config_.submap_keyframes)) {
    const std::size_t away = i < k.keyframe ? k.keyframe - i : i - k.keyframe;
    // Both of two as near, or neither.
    if (away != last_away && points.size() >= config_.submap_cells) break;
    last_away = away;
    add(i);
  }
  return RegistrationCloud(points, ground, config_);
}

}  // namespace unimapper::merge
