#include "src/apps/view/pose_epochs.hpp"

#include <algorithm>

namespace unimapper::apps {

const PoseEpochs::Checksums& PoseEpochs::checksums_of(store::ProjectReader& project,
                                                      const store::Epoch& epoch) {
  const auto key = std::make_tuple(epoch.number, epoch.result, epoch.made_s);
  const auto found = known_.find(key);
  if (found != known_.end()) return found->second;
  // What this epoch was before it was replaced.
  known_.erase(known_.lower_bound({epoch.number, INT64_MIN, INT64_MIN}),
               known_.lower_bound({epoch.number + 1, INT64_MIN, INT64_MIN}));
  return known_.emplace(key, epoch.result == 0 ? Checksums{} : project.pose_checksums(epoch.result))
      .first->second;
}

std::map<std::int64_t, std::int64_t> PoseEpochs::last_changed(
    store::ProjectReader& project, const std::vector<store::Epoch>& epochs, std::int64_t number) {
  const std::lock_guard lock(mutex_);
  auto epoch = std::find_if(epochs.rbegin(), epochs.rend(),
                            [&](const store::Epoch& e) { return e.number == number; });
  std::map<std::int64_t, std::int64_t> changed;
  if (epoch == epochs.rend()) return changed;
  const Checksums shown = checksums_of(project, *epoch);
  for (const auto& [row, checksum] : shown) changed[row] = number;
  Checksums open = shown;  // sessions that no epoch has moved yet, going back
  for (++epoch; epoch != epochs.rend() && !open.empty(); ++epoch) {
    const Checksums& before = checksums_of(project, *epoch);
    std::erase_if(open, [&](const auto& session) {
      const auto same = before.find(session.first);
      return same == before.end() || same->second != session.second;
    });
    for (const auto& [row, checksum] : open) changed[row] = epoch->number;
  }
  return changed;
}

}  // namespace unimapper::apps
