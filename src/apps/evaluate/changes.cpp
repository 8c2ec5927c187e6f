// `unimapper evaluate changes`: precision and recall of changed objects.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/evaluate/map_alignment.hpp"
#include "src/apps/evaluate/standing_objects.hpp"

namespace unimapper::apps {
namespace {

using evaluate::FoundChange;
using evaluate::TrueChange;

/// Parked cars and vans: what recall is about.
constexpr std::array kVehicles = {10, 18};

/// Scans that saw an object, or through its place, at least.
constexpr std::size_t kSureScans = 10;

UprightBox transformed(const Pose& T, const UprightBox& box) {
  const Eigen::Vector3d axis =
      T.rotation * Eigen::Vector3d(std::cos(box.yaw_rad), std::sin(box.yaw_rad), 0.0);
  return {T * box.centre, std::atan2(axis.y(), axis.x()), box.size};
}

/// Changes of a map between two sessions, in the truth's frame.
struct FoundChanges {
  std::vector<FoundChange> changes;
  std::vector<bool> exist_later;  ///< of each change, whether it exists in the later session
};

FoundChanges changes_between(const EvaluateChangesOptions& options, const Pose& T_truth_map) {
  const std::string& earlier = options.earlier.first;
  const std::string& later = options.later.first;
  FoundChanges found;
  for (const ReportedChange& change : read_changes(options.map)) {
    if (std::set{change.session, change.free_in} != std::set{earlier, later}) continue;
    found.changes.push_back({change.change, transformed(T_truth_map, change.box)});
    found.exist_later.push_back(change.session == later);
  }
  return found;
}

/// Whether each found change is something that stood there during the visit.
std::vector<bool> what_stood(const EvaluateChangesOptions& options, const FoundChanges& found) {
  std::vector<bool> stood(found.changes.size(), false);
  for (const bool is_later : {false, true}) {
    std::vector<std::size_t> numbers;
    std::vector<UprightBox> boxes;
    for (std::size_t i = 0; i < found.changes.size(); ++i) {
      if (found.exist_later[i] != is_later) continue;
      numbers.push_back(i);
      boxes.push_back(found.changes[i].box);
    }
    const auto& recording = (is_later ? options.later : options.earlier).second;
    const std::vector<BoxReturns> returns = count_returns(recording, boxes, options.reach_m);
    const std::vector<evaluate::StandingObject> scene = read_objects(recording);
    for (std::size_t n = 0; n < numbers.size(); ++n) {
      // What belongs to the scene and has not changed is none of it.
      const bool is_scene = std::any_of(scene.begin(), scene.end(), [&](const auto& object) {
        return object.box.covers(boxes[n].centre);
      });
      stood[numbers[n]] = !is_scene && returns[n].standing > returns[n].others;
    }
  }
  return stood;
}

void mark_observable(const EvaluateChangesOptions& options, std::vector<TrueChange>& truth) {
  std::vector<UprightBox> boxes;
  boxes.reserve(truth.size());
  for (const TrueChange& change : truth) boxes.push_back(change.box);
  const ObjectSightings earlier = count_sightings(options.earlier.second, boxes, options.reach_m);
  const ObjectSightings later = count_sightings(options.later.second, boxes, options.reach_m);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const bool gone = truth[i].change == ChangeKind::kGone;
    const ObjectSightings& with = gone ? earlier : later;
    const ObjectSightings& without = gone ? later : earlier;
    truth[i].is_observable =
        with.scans_hit[i] >= kSureScans && without.scans_seen_through[i] >= kSureScans;
  }
}

}  // namespace

std::string evaluate_changes(const EvaluateChangesOptions& options) {
  const auto sessions = pair_sessions(options.map, {options.earlier, options.later});
  const Pose T_truth_map = align_central(sessions).T_truth_estimate;
  std::vector<TrueChange> truth = evaluate::true_changes(read_objects(options.earlier.second),
                                                         read_objects(options.later.second));
  mark_observable(options, truth);
  const FoundChanges found = changes_between(options, T_truth_map);
  const evaluate::ChangeScore score =
      evaluate::score_changes(found.changes, truth, what_stood(options, found), kVehicles);
  return changes_json(found.changes, truth, score);
}

}  // namespace unimapper::apps
