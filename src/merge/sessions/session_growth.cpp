#include "session_growth.hpp"

#include <algorithm>
#include <utility>

namespace unimapper::merge {

std::vector<SessionChange> SessionGrowth::look(const std::vector<SessionData>& sessions) {
  seen_.resize(sessions.size());
  std::vector<SessionChange> changes;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const std::vector<Seen> before = std::move(seen_[s]);
    std::vector<Seen>& now = seen_[s] = {};
    for (const KeyframeRecord& keyframe : sessions[s].keyframes) {
      now.push_back({keyframe.sequence, keyframe.is_summary, keyframe.T_odometry_keyframe});
    }
    const auto is_same = [](const Seen& a, const Seen& b) {
      return a.sequence == b.sequence && a.is_summary == b.is_summary &&
             a.T_odometry_keyframe.rotation == b.T_odometry_keyframe.rotation &&
             a.T_odometry_keyframe.translation == b.T_odometry_keyframe.translation;
    };
    const auto less = [](const Seen& a, const Seen& b) { return a.sequence < b.sequence; };
    const auto is_in = [&](const std::vector<Seen>& list, const Seen& keyframe) {
      const auto at = std::lower_bound(list.begin(), list.end(), keyframe, less);
      return at != list.end() && is_same(*at, keyframe);
    };
    SessionChange change;
    change.session = s;
    const auto differ =
        std::mismatch(now.begin(), now.end(), before.begin(), before.end(), is_same);
    change.first = static_cast<std::size_t>(differ.first - now.begin());
    for (std::size_t k = change.first; k < now.size(); ++k) {
      if (!is_in(before, now[k])) change.fresh.push_back(k);
    }
    for (auto old = differ.second; old != before.end(); ++old) {
      if (!is_in(now, *old)) change.stale.push_back(old->sequence);
    }
    if (!change.fresh.empty() || !change.stale.empty()) changes.push_back(std::move(change));
  }
  return changes;
}

}  // namespace unimapper::merge
