// Cache of registration clouds by keyframe.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "registration.hpp"
#include "src/merge/limited_cache.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_constraint.hpp"

namespace unimapper::merge {

/// Neighbours before and after a keyframe that may join its cloud.
inline constexpr std::uint32_t kSubmapKeyframes = 2;

/// What a keyframe's cloud is made of.
struct Submap {
  std::vector<Eigen::Vector3f> points;  ///< in the keyframe's frame
  std::vector<std::uint8_t> ground;     ///< of each point
  std::vector<std::size_t> keyframes;   ///< whose points these are: its own first
};

/// Reads the keyframe, and neighbours only while it has too few cells of its own. O(cells).
Submap submap_of(const SessionData& session, std::size_t k);

/// A keyframe's cloud is a local submap: it also holds its neighbours' cells, transformed by
/// odometry, because a narrow field of view alone constrains a registration too little. Clouds that
/// were used last are kept, up to a number of bytes.
class KeyframeClouds {
 public:
  static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

  KeyframeClouds(const std::vector<SessionData>& sessions, const RegistrationConfig& config,
                 unsigned threads, std::uint64_t max_bytes = kUnlimited);

  /// Makes what is missing for the given keyframes in parallel, as far as it can be kept; sessions
  /// may have grown since the last call.
  void prepare(std::vector<KeyframeId> keyframes);

  /// The first `count` keyframes of a session are gone from its data.
  void forget_first(std::size_t session, std::size_t count);

  /// Keyframes of a session, from that one on, or their neighbours are others than before; the
  /// session may be new. No other thread may be in `cloud`.
  void forget_from(std::size_t session, std::size_t keyframe);

  /// The cloud of a keyframe, which is made if it is not kept. Thread safe.
  [[nodiscard]] std::shared_ptr<const RegistrationCloud> cloud(KeyframeId k) const;
  /// A keyframe, perhaps without cells and images.
  [[nodiscard]] const KeyframeRecord& record(KeyframeId k) const {
    return sessions_[k.session].keyframes[k.keyframe];
  }
  [[nodiscard]] std::shared_ptr<const KeyframeRecord> whole(KeyframeId k) const {
    return whole_keyframe(sessions_[k.session], k.keyframe);
  }

 private:
  [[nodiscard]] RegistrationCloud make_cloud(KeyframeId k) const;
  /// Numbers of keyframes from the first one that ever was in the session.
  [[nodiscard]] KeyframeId key(KeyframeId k) const;

  const std::vector<SessionData>& sessions_;
  const RegistrationConfig& config_;
  unsigned threads_;
  std::vector<std::size_t> forgotten_;  ///< keyframes that are gone, by session
  mutable LimitedCache<KeyframeId, RegistrationCloud> clouds_;
};

}  // namespace unimapper::merge
