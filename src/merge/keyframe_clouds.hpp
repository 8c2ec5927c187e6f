// Registration clouds of keyframes, built on demand
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/registration.hpp"

namespace unimapper::merge {

/// A keyframe's cloud also holds its neighbours' cells, carried over by odometry: a narrow field
/// of view alone shows too little to be aligned.
class KeyframeClouds {
 public:
  KeyframeClouds(const std::vector<SessionData>& sessions, const RegistrationConfig& config,
                 unsigned threads);

  /// Makes what is missing for the given keyframes. Not to be called while others read.
  void prepare(std::vector<KeyframeRef> keyframes);

  /// Only for keyframes that were prepared.
  [[nodiscard]] const RegistrationCloud& cloud(KeyframeRef k) const {
    return *clouds_[k.session][k.keyframe];
  }
  [[nodiscard]] const KeyframeRecord& record(KeyframeRef k) const {
    return sessions_[k.session].keyframes[k.keyframe];
  }

 private:
  [[nodiscard]] RegistrationCloud make_cloud(KeyframeRef k) const;

  const std::vector<SessionData>& sessions_;
  const RegistrationConfig& config_;
  unsigned threads_;
  std::vector<std::vector<std::unique_ptr<RegistrationCloud>>> clouds_;
};

}  // namespace unimapper::merge
