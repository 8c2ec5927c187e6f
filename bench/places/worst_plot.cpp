#include "bench/places/worst_plot.hpp"

#include <algorithm>
#include <cstdio>
#include <set>
#include <sstream>

#include "bench/places/failures.hpp"
#include "ports/datasets/writers.hpp"

namespace unimapper::bench {
namespace {

void put(std::ostream& out, int what, const Eigen::Vector2d& at) {
  out << what << ',' << at.x() << ',' << at.y() << '\n';
}

/// Occupied columns and keypoints of a keyframe, transformed by `T_there_world`.
void put_keyframe(std::ostream& out, int what, const SceneDrive& drive, std::size_t keyframe,
                  const Pose& T_there_world) {
  for (const Eigen::Vector2d& column : drive.narrow_columns[keyframe].centers()) {
    const Eigen::Vector3d world(column.x(), column.y(), 0.0);
    put(out, what, (T_there_world * world).head<2>());
  }
  const OwnedPlace& place = drive.described.front()[keyframe];
  const Pose T_there_place =
      T_there_world * drive.drive.keyframes[keyframe].T_world_keyframe * place.T_keyframe_place;
  for (const Keypoint& keypoint : place.keypoints) {
    const Eigen::Vector3d position = keypoint.position.cast<double>();
    put(out, what + 1, (T_there_place * position).head<2>());
  }
}

std::string text_of(const PairRow& row, const Failure& failure, std::size_t shown) {
  const TopCandidate& top = *failure.top;
  char numbers[160];
  std::snprintf(numbers, sizeof numbers, ": %s, off by %.1f m and %.0f degrees, confidence %.3f",
                failure.why, top.error_m, top.error_deg, top.confidence);
  return row.scene + ", " + row.query_sensor + " route " + row.route + " keyframe " +
         std::to_string(top.query) + " and " + row.reference_sensor + " route A keyframe " +
         std::to_string(shown) + (top.answered ? numbers : std::string(": ") + failure.why);
}

FailurePicture draw(const DrivePair& pair, const PairRow& row, const Failure& failure) {
  const TopCandidate& top = *failure.top;
  const bool answered = top.answered && top.match != kDistractor;
  const std::size_t match = answered ? top.match : pair.best_view(top.query);
  const Pose& T_world_match = pair.references->drive.keyframes[match].T_world_keyframe;
  const Pose& T_world_query = pair.queries->drive.keyframes[top.query].T_world_keyframe;
  Pose T_there_world;
  T_there_world.translation = -T_world_match.translation;
  std::ostringstream out;
  out << "what,x,y\n";
  put_keyframe(out, 0, *pair.references, match, T_there_world);
  put_keyframe(out, 2, *pair.queries, top.query, T_there_world);
  if (answered) {
    const Pose T_answered_world = T_world_match * top.T_match_query * T_world_query.inverse();
    put_keyframe(out, 4, *pair.queries, top.query, T_there_world * T_answered_world);
  }
  return {text_of(row, failure, match), out.str()};
}

}  // namespace

std::vector<FailurePicture> worst_failures(const std::vector<DrivePair>& pairs,
                                           const std::vector<PairRow>& rows, std::size_t most) {
  std::vector<FailurePicture> pictures;
  for (const bool false_loops : {true, false}) {
    std::set<std::size_t> shown;  // rows
    for (const Failure& failure : failures_of(rows)) {
      if (shown.size() == most) break;
      if (is_false_loop(*failure.top) != false_loops || !shown.insert(failure.row).second) continue;
      pictures.push_back(draw(pairs[failure.row], rows[failure.row], failure));
    }
  }
  return pictures;
}

void write_failure_pictures(const std::filesystem::path& folder,
                            const std::vector<FailurePicture>& pictures) {
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string name = "worst-" + std::to_string(i);
    datasets::write_text(folder / (name + ".title"), pictures[i].title + "\n");
    datasets::write_text(folder / (name + ".csv"), pictures[i].csv);
  }
}

}  // namespace unimapper::bench
