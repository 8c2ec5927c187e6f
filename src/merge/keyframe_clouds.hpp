// Cache of registration clouds by keyframe.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/registration.hpp"

namespace unimapper::merge {

/// A keyframe's cloud is a local submap: it also holds its neighbours' cells, transformed by
/// odometry, because a narrow field of view alone constrains a registration too little.
class KeyframeClouds {
 public:
  KeyframeClouds(const std::vector<SessionData>& sessions, const RegistrationConfig& config,
                 unsigned threads);

  /// Makes what is missing for the given keyframes; sessions may have grown since the last call.
  /// Not to be called while other threads read.
  void prepare(std::vector<KeyframeId> keyframes);

  /// The first `count` keyframes of a session are gone from its data.
  void forget_first(std::size_t session, std::size_t count);

  /// Only for keyframes that were prepared.
  [[nodiscard]] const RegistrationCloud& cloud(KeyframeId k) const {
    return *clouds_[k.session][k.keyframe];
  }
  [[nodiscard]] const KeyframeRecord& record(KeyframeId k) const {
    return sessions_[k.session].keyframes[k.keyframe];
  }

 private:
  [[nodiscard]] RegistrationCloud make_cloud(KeyframeId k) const;

  const std::vector<SessionData>& sessions_;
  const RegistrationConfig& config_;
  unsigned threads_;
  std::vector<std::vector<std::unique_ptr<RegistrationCloud>>> clouds_;
};

}  // namespace unimapper::merge
