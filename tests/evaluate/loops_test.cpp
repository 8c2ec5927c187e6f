// Tests of precision and recall of loops.
#include "src/evaluate/loops.hpp"

#include "tests/test.hpp"

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

/// A loop with the true pose.
LoopRecord loop(std::uint32_t query, std::uint32_t match, double confidence, bool accepted = true,
                const std::vector<TrueKeyframe>& keyframes = there_and_back()) {
  LoopRecord record;
  record.query_keyframe = query;
  record.match_keyframe = match;
  record.confidence = confidence;
  record.accepted = accepted;
  record.T_match_query =
      keyframes[match].T_world_sensor.inverse() * keyframes[query].T_world_sensor;
  return record;
}

LoopScore score(const std::vector<LoopRecord>& loops,
                const std::vector<TrueKeyframe>& keyframes = there_and_back()) {
  LoopScoreConfig config;
  config.min_gap_keyframes = 3;
  return score_loops(keyframes, keyframes, loops, config);
}

}  // namespace

TEST_CASE("precision and recall count one loop per query, the sweep its best candidate") {
  const LoopScore result = score({
      loop(5, 0, 0.9), loop(6, 1, 0.8), loop(7, 1, 0.7),  // wrong: 7 is where keyframe 2 is
      loop(8, 3, 0.6, false),                             // right, but not accepted
      loop(8, 2, 0.5, false),                             // not the best of query 8: never counts
  });
  CHECK(result.queries == 10);
  CHECK(result.positives == 5);
  const LoopFigures& figures = result.by_distance;
  const PrecisionRecall& point = figures.operating_point;
  CHECK(point.true_positives == 2);
  CHECK(point.false_positives == 1);
  CHECK(point.false_negatives == 3);
  CHECK(point.precision == Approx(2.0 / 3.0));
  CHECK(point.recall == Approx(0.4));
  CHECK(point.f1 == Approx(0.5));

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
  const LoopFigures figures = score({loop(5, 0, 0.5), loop(6, 0, 0.5)}).by_distance;
  REQUIRE(figures.curve.size() == 1);
  CHECK(figures.curve[0].precision == 0.5);
  CHECK(figures.recall_at_full_precision == 0.0);
}

TEST_CASE("a match by pose needs the reported pose to be right") {
  LoopRecord shifted = loop(5, 0, 0.9);
  shifted.T_match_query.translation.y() += 2.5;
  LoopRecord turned = loop(6, 1, 0.8);
  turned.T_match_query = turned.T_match_query * at(0.0, 0.1);  // 5.7 degrees
  LoopRecord close = loop(7, 2, 0.7);
  close.T_match_query.translation.x() += 1.0;
  const LoopScore result = score({shifted, turned, close});
  CHECK(result.by_distance.operating_point.precision == 1.0);
  CHECK(result.by_pose.operating_point.true_positives == 1);
  CHECK(result.by_pose.operating_point.false_positives == 2);
  CHECK(result.by_pose.operating_point.recall == Approx(0.2));
  CHECK(result.by_pose.recall_at_full_precision == 0.0);
  CHECK(result.translation_error_m.median == Approx(1.0));
  CHECK(result.rotation_error_deg.max == Approx(5.7296).margin(1e-3));
}

TEST_CASE("a far-away match with the right pose is true by pose, not by distance") {
  // 7 is 100 m from 1 and 9 is no revisit of 2, yet both reported poses are right.
  auto far = there_and_back();
  far[9].T_world_sensor.translation.x() = 450;
  const LoopScore result = score({loop(7, 1, 0.9, true, far), loop(9, 2, 0.8, true, far)}, far);
  REQUIRE(result.positives == 4);
  CHECK(result.by_distance.operating_point.precision == 0.0);
  CHECK(result.by_pose.operating_point.precision == 1.0);
  CHECK(result.by_pose.operating_point.recall == 0.25);  // of the positives, 7 alone
  CHECK(result.by_pose.operating_point.false_negatives == 3);
  CHECK(result.by_pose.recall_at_full_precision == 0.25);
}

TEST_CASE("within a session neither later keyframes nor neighbours may match") {
  const LoopScore result = score({loop(0, 5, 0.9), loop(2, 1, 0.9), loop(5, 9, 0.9)});
  CHECK(result.loops_left_out == 3);
  CHECK(result.loops == 0);
  CHECK(std::isnan(result.by_distance.operating_point.precision));
  CHECK(result.by_distance.operating_point.recall == 0.0);
}

TEST_CASE("against another run any keyframe may match") {
  const std::vector<TrueKeyframe> queries = {{0, 0, at(101)}, {1, 10, at(-50)}};
  LoopRecord right;
  right.match_keyframe = 6;
  right.confidence = 0.4;
  right.accepted = true;
  LoopRecord unknown = right;
  unknown.match_keyframe = 77;
  LoopScoreConfig config;
  config.same_session = false;
  const LoopScore result =
      score_loops(queries, there_and_back(), std::vector{right, unknown}, config);
  CHECK(result.positives == 1);
  CHECK(result.by_distance.operating_point.true_positives == 1);
  CHECK(result.by_distance.operating_point.recall == 1.0);
  CHECK(result.loops_left_out == 1);
}

TEST_CASE("a run without revisits has no recall") {
  auto keyframes = there_and_back();
  keyframes.resize(5);
  const LoopScore result = score({}, keyframes);
  CHECK(result.positives == 0);
  CHECK(std::isnan(result.by_distance.operating_point.recall));
  CHECK(result.by_distance.curve.empty());
}
