#include "bench/places/database_scaling.hpp"

#include <algorithm>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>

#include "bench/places/common_view.hpp"
#include "bench/places/quantile.hpp"
#include "bench/places/stopwatch.hpp"
#include "bench/places/synthetic_place.hpp"

namespace unimapper::bench {
namespace {

constexpr double kCommonView = 0.30;
constexpr std::uint32_t kKnownSession = 0;
constexpr std::uint32_t kQuerySession = 1;
constexpr std::uint32_t kFirstDistractorSession = 2;
constexpr std::uint32_t kSessionSize = 1000;
constexpr double kStep_m = 7.0;  // between places of a session

std::vector<ViewVoxels> views_of(const Drive& drive) {
  std::vector<ViewVoxels> views;
  for (const PlaceKeyframe& keyframe : drive.keyframes) {
    views.push_back(view_voxels(keyframe.static_cells, keyframe.T_world_keyframe));
  }
  return views;
}

std::vector<bool> answers_in(const std::vector<ViewVoxels>& known, const Drive& queries) {
  std::vector<bool> has_answer;
  for (const ViewVoxels& view : views_of(queries)) {
    has_answer.push_back(std::any_of(known.begin(), known.end(), [&](const ViewVoxels& other) {
      return common_view(view, other) >= kCommonView;
    }));
  }
  return has_answer;
}

bool is_right_pose(const Pose& T_match_query, const PlaceKeyframe& match,
                   const PlaceKeyframe& query) {
  const Pose truth = match.T_world_keyframe.inverse() * query.T_world_keyframe;
  const Pose error = truth.inverse() * T_match_query;
  const evaluate::LoopScoreConfig limits;
  return error.translation.norm() <= limits.pose_translation_m &&
         rotation_angle(error.rotation) * kDegreesPerRadian <= limits.pose_rotation_deg;
}

Pose along_a_line(std::uint32_t i) {
  Pose pose;
  pose.translation.x() = kStep_m * i;
  return pose;
}

/// A database with measured insertions and searches.
class MeasuredDatabase {
 public:
  explicit MeasuredDatabase(const LoopSearchConfig& config) : database_(config) {}

  void insert(const OwnedPlace& place, KeyframeId id, const Pose& T_session_place) {
    const double start = thread_milliseconds();
    database_->insert(place.view(), id, T_session_place);
    insert_ms_.push_back(thread_milliseconds() - start);
  }
  [[nodiscard]] std::uint32_t size() { return database_->size(); }
  [[nodiscard]] std::size_t bytes() const { return database_.bytes(); }

  ScalingStep measure(const ScalingTask& task) {
    ScalingStep step;
    step.places = database_->size();
    step.insert_ms = mean(insert_ms_);
    insert_ms_.clear();
    std::vector<double> query_ms;
    Tally tally;
    for (std::size_t d = 0; d < task.queries.size(); ++d) ask(task, d, query_ms, tally);
    step.query_p50_ms = quantile(query_ms, 0.5);
    step.query_p99_ms = quantile(query_ms, 0.99);
    step.found_share = tally.found / tally.positives;
    step.accepted_share = tally.accepted / tally.positives;
    step.wrong = tally.wrong;
    step.dropped = database_->dropped();
    return step;
  }

 private:
  struct Tally {
    double positives = 0.0;
    double found = 0.0;
    double accepted = 0.0;
    std::size_t wrong = 0;
  };

  void ask(const ScalingTask& task, std::size_t drive, std::vector<double>& query_ms,
           Tally& tally) {
    const DescribedDrive& queries = task.queries[drive];
    for (std::uint32_t i = 0; i < queries.places.size(); ++i) {
      const double start = thread_milliseconds();
      const auto found = database_->search(queries.places[i].view(), {kQuerySession, i},
                                           {SearchScope::Sessions::kOnlyOther, 0});
      query_ms.push_back(thread_milliseconds() - start);
      const bool positive = task.has_answer[drive][i];
      tally.positives += positive ? 1.0 : 0.0;
      if (found.empty()) continue;
      const LoopCandidate& best = found.front();
      const bool right =
          best.match.session == kKnownSession &&
          is_right_pose(best.T_match_query, task.known.drive.keyframes[best.match.keyframe],
                        queries.drive.keyframes[i]);
      tally.found += right && positive ? 1.0 : 0.0;
      tally.accepted += right && positive && best.accepted ? 1.0 : 0.0;
      tally.wrong += best.accepted && !right ? 1 : 0;
    }
  }

  merge::InArena<PlaceDatabase> database_;
  std::vector<double> insert_ms_;
};

}  // namespace

DescribedDrive read_and_describe(const std::filesystem::path& run, bool with_truth) {
  DescribedDrive described;
  described.drive = with_truth ? read_drive(run) : read_drive_without_truth(run);
  described.places = describe(described.drive, PipelineConfig{});
  return described;
}

Distractors real_places(const std::vector<DescribedDrive>& drives) {
  return [&drives](std::uint32_t i) -> Distractor {
    std::uint32_t session = 0;
    for (const DescribedDrive& drive : drives) {
      if (i < drive.places.size()) return {drive.places[i], session};
      i -= static_cast<std::uint32_t>(drive.places.size());
      ++session;
    }
    throw std::out_of_range("not so many distractors");
  };
}

Distractors synthetic_places(const std::vector<DescribedDrive>& drives, std::uint32_t seed) {
  auto sources = std::make_shared<std::vector<const OwnedPlace*>>();
  for (const DescribedDrive& drive : drives) {
    for (const OwnedPlace& place : drive.places) sources->push_back(&place);
  }
  if (sources->empty()) throw std::runtime_error("no distractors to mix places from");
  auto random = std::make_shared<std::mt19937>(seed);
  return [sources, random](std::uint32_t i) -> Distractor {
    std::uniform_int_distribution<std::size_t> which(0, sources->size() - 1);
    std::uniform_real_distribution<double> yaw(-std::numbers::pi, std::numbers::pi);
    const OwnedPlace& a = *(*sources)[which(*random)];
    const OwnedPlace& b = *(*sources)[which(*random)];
    const double yaw_a = yaw(*random);
    return {mix_halves(a, yaw_a, b, yaw(*random)), i / kSessionSize};
  };
}

ScalingTask make_task(const std::filesystem::path& known,
                      const std::vector<std::filesystem::path>& queries) {
  ScalingTask task;
  task.known = read_and_describe(known, true);
  const auto views = views_of(task.known.drive);
  release_cells(task.known.drive);
  for (const auto& run : queries) {
    task.queries.push_back(read_and_describe(run, true));
    task.has_answer.push_back(answers_in(views, task.queries.back().drive));
    release_cells(task.queries.back().drive);
  }
  return task;
}

ScalingResult measure_scaling(const ScalingTask& task, const Distractors& distractors,
                              const std::vector<std::uint32_t>& sizes,
                              const LoopSearchConfig& config) {
  MeasuredDatabase database(config);
  ScalingResult scaling;
  scaling.bytes = database.bytes();
  for (std::uint32_t i = 0; i < task.known.places.size(); ++i) {
    database.insert(task.known.places[i], {kKnownSession, i},
                    task.known.drive.keyframes[i].T_odometry_keyframe);
  }
  std::uint32_t added = 0;
  for (const std::uint32_t size : sizes) {
    if (size < database.size() || size > config.max_places) continue;
    while (database.size() < size) {
      const Distractor distractor = distractors(added);
      database.insert(distractor.place, {kFirstDistractorSession + distractor.session, added},
                      along_a_line(added));
      ++added;
    }
    scaling.steps.push_back(database.measure(task));
  }
  return scaling;
}

}  // namespace unimapper::bench
