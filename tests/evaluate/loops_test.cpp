// Tests of precision and recall of loops.
#include "unimapper/evaluate/loops.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace unimapper;
using namespace unimapper::evaluate;

namespace {

Pose at(double x, double yaw = 0.0) {
  return {Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {x, 0, 0}};
}

/// Keyframes 0..4 at 0, 100, …, 400 m, then 5..9 back at the same positions, 3 m aside.
std::vector<TrueKeyframe> there_and_back() {
  std::vector<TrueKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 10; ++i) {
    keyframes.push_back({i, i * 10, at(100.0 * (i % 5) + (i < 5 ? 0.0 : 3.0))});
  }
  return keyframes;
}

LoopRecord loop(const std::vector<TrueKeyframe>& keyframes, std::uint32_t query,
                std::uint32_t match, double confidence, bool accepted) {
  LoopRecord record;
  record.query_keyframe = query;
  record.match_keyframe = match;
  record.confidence = confidence;
  record.accepted = accepted;
  record.T_match_query =
      keyframes[match].T_world_sensor.inverse() * keyframes[query].T_world_sensor;
  return record;
}

LoopScoreConfig session_config() {
  LoopScoreConfig config;
  config.min_gap_keyframes = 3;
  return config;
}

}  // namespace

TEST_CASE("precision and recall count one loop per query") {
  const auto keyframes = there_and_back();
  const std::vector<LoopRecord> loops = {
      loop(keyframes, 5, 0, 0.9, true),   // right
      loop(keyframes, 6, 1, 0.8, true),   // right
      loop(keyframes, 7, 1, 0.7, true),   // wrong: 7 is where keyframe 2 is
      loop(keyframes, 8, 3, 0.6, false),  // right, but not accepted
  };
  const LoopScore score = score_loops(keyframes, keyframes, loops, session_config());
  CHECK(score.queries == 10);
  CHECK(score.positives == 5);
  const PrecisionRecall& point = score.by_distance.operating_point;
  CHECK(point.true_positives == 2);
  CHECK(point.false_positives == 1);
  CHECK(point.false_negatives == 3);
  CHECK(point.precision == Approx(2.0 / 3.0));
  CHECK(point.recall == Approx(0.4));
  CHECK(point.f1 == Approx(0.5));
}

TEST_CASE("the sweep runs down the confidences of each query's best candidate") {
  const auto keyframes = there_and_back();
  const std::vector<LoopRecord> loops = {
      loop(keyframes, 5, 0, 0.9, true),  loop(keyframes, 6, 1, 0.8, true),
      loop(keyframes, 7, 1, 0.7, true),  loop(keyframes, 8, 3, 0.6, false),
      loop(keyframes, 8, 2, 0.5, false),  // not the best of query 8: never counts
  };
  const LoopFigures figures =
      score_loops(keyframes, keyframes, loops, session_config()).by_distance;
  REQUIRE(figures.curve.size() == 4);
  CHECK(figures.curve[0].precision == 1.0);
  CHECK(figures.curve[0].recall == Approx(0.2));
  CHECK(figures.curve[1].recall == Approx(0.4));
  CHECK(figures.curve[2].precision == Approx(2.0 / 3.0));
  CHECK(figures.curve[3].precision == Approx(0.75));
  CHECK(figures.curve[3].recall == Approx(0.6));
  CHECK(figures.recall_at_full_precision == Approx(0.4));
  CHECK(figures.f1_max == Approx(2 * 0.75 * 0.6 / 1.35));
  // 0..0.4 at 1; a step down at 0.4; 0.4..0.6 from 2/3 to 3/4.
  CHECK(figures.auc == Approx(0.4 + 0.2 * 0.5 * (2.0 / 3.0 + 0.75)));
}

TEST_CASE("equal confidences cannot be told apart by any threshold") {
  const auto keyframes = there_and_back();
  const std::vector<LoopRecord> loops = {loop(keyframes, 5, 0, 0.5, true),
                                         loop(keyframes, 6, 0, 0.5, true)};
  const LoopFigures figures =
      score_loops(keyframes, keyframes, loops, session_config()).by_distance;
  REQUIRE(figures.curve.size() == 1);
  CHECK(figures.curve[0].precision == 0.5);
  CHECK(figures.recall_at_full_precision == 0.0);
}

TEST_CASE("a match by pose needs the reported pose to be right") {
  const auto keyframes = there_and_back();
  LoopRecord shifted = loop(keyframes, 5, 0, 0.9, true);
  shifted.T_match_query.translation.y() += 2.5;
  LoopRecord turned = loop(keyframes, 6, 1, 0.8, true);
  turned.T_match_query = turned.T_match_query * at(0.0, 0.1);  // 5.7 degrees
  LoopRecord close = loop(keyframes, 7, 2, 0.7, true);
  close.T_match_query.translation.x() += 1.0;
  const LoopScore score =
      score_loops(keyframes, keyframes, std::vector{shifted, turned, close}, session_config());
  CHECK(score.by_distance.operating_point.precision == 1.0);
  CHECK(score.by_pose.operating_point.true_positives == 1);
  CHECK(score.by_pose.operating_point.false_positives == 2);
  CHECK(score.by_pose.operating_point.recall == Approx(0.2));
  CHECK(score.by_pose.recall_at_full_precision == 0.0);
  CHECK(score.translation_error_m.median == Approx(1.0));
  CHECK(score.rotation_error_deg.max == Approx(5.7296).margin(1e-3));
}

TEST_CASE("a far-away match with the right pose is true by pose, not by distance") {
  const auto keyframes = there_and_back();
  // 7 is 100 m from 1 and 9 is no revisit of 2, yet both reported poses are right.
  auto far = keyframes;
  far[9].T_world_sensor.translation.x() = 450;
  const std::vector<LoopRecord> loops = {loop(far, 7, 1, 0.9, true), loop(far, 9, 2, 0.8, true)};
  const LoopScore score = score_loops(far, far, loops, session_config());
  REQUIRE(score.positives == 4);
  CHECK(score.by_distance.operating_point.precision == 0.0);
  CHECK(score.by_pose.operating_point.precision == 1.0);
  CHECK(score.by_pose.operating_point.recall == 0.25);  // of the positives, 7 alone
  CHECK(score.by_pose.operating_point.false_negatives == 3);
  CHECK(score.by_pose.recall_at_full_precision == 0.25);
}

TEST_CASE("within a session neither later keyframes nor neighbours may match") {
  auto keyframes = there_and_back();
  const std::vector<LoopRecord> loops = {loop(keyframes, 0, 5, 0.9, true),
                                         loop(keyframes, 2, 1, 0.9, true),
                                         loop(keyframes, 5, 99 % 10, 0.9, true)};
  const LoopScore score = score_loops(keyframes, keyframes, loops, session_config());
  CHECK(score.loops_left_out == 3);
  CHECK(score.loops == 0);
  CHECK(std::isnan(score.by_distance.operating_point.precision));
  CHECK(score.by_distance.operating_point.recall == 0.0);
}

TEST_CASE("against another run any keyframe may match") {
  const auto references = there_and_back();
  const std::vector<TrueKeyframe> queries = {{0, 0, at(101)}, {1, 10, at(-50)}};
  LoopRecord right;
  right.match_keyframe = 6;
  right.confidence = 0.4;
  right.accepted = true;
  LoopRecord unknown = right;
  unknown.match_keyframe = 77;
  LoopScoreConfig config;
  config.same_session = false;
  const LoopScore score = score_loops(queries, references, std::vector{right, unknown}, config);
  CHECK(score.positives == 1);
  CHECK(score.by_distance.operating_point.true_positives == 1);
  CHECK(score.by_distance.operating_point.recall == 1.0);
  CHECK(score.loops_left_out == 1);
}

TEST_CASE("a run without revisits has no recall") {
  std::vector<TrueKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 5; ++i) keyframes.push_back({i, i, at(100.0 * i)});
  const LoopScore score = score_loops(keyframes, keyframes, {}, session_config());
  CHECK(score.positives == 0);
  CHECK(std::isnan(score.by_distance.operating_point.recall));
  CHECK(score.by_distance.curve.empty());
}
