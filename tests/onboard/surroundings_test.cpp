// Indoor and outdoor setting, and the choice between them
#include "unimapper/onboard/surroundings.hpp"

#include <numbers>

#include "tests/test.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/pipeline.hpp"

using namespace unimapper;

namespace {

/// A scan of `near` points in all directions at `near_m` and `far` points at `far_m`.
struct Ring {
  std::size_t near = 1980;
  float near_m = 12.0F;
  std::size_t far = 20;
  float far_m = 60.0F;
  float from_deg = 0.0F;
  float to_deg = 360.0F;
};

std::vector<Eigen::Vector3f> scan(const Ring& ring) {
  std::vector<Eigen::Vector3f> points;
  const auto add = [&](std::size_t count, float range_m) {
    for (std::size_t i = 0; i < count; ++i) {
      const float share = (static_cast<float>(i) + 0.5F) / static_cast<float>(count);
      const float angle = (ring.from_deg + share * (ring.to_deg - ring.from_deg)) *
                          std::numbers::pi_v<float> / 180.0F;
      points.emplace_back(range_m * std::cos(angle), range_m * std::sin(angle), 0.0F);
    }
  };
  add(ring.near, ring.near_m);
  add(ring.far, ring.far_m);
  return points;
}

void add(SurroundingsEstimator& estimator, const std::vector<Eigen::Vector3f>& points) {
  estimator.add(PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f)));
}

SurroundingsEstimate estimate(const std::vector<Ring>& rings) {
  SurroundingsEstimator estimator;
  for (const Ring& ring : rings) add(estimator, scan(ring));
  return estimator.estimate();
}

bool indoors(const std::vector<Ring>& rings) {
  return estimate(rings).surroundings == Surroundings::kIndoors;
}

}  // namespace

TEST_CASE("Surroundings are indoors if 99 % of the points lie within 30 m, all round") {
  CHECK(indoors({{}}));
  CHECK_FALSE(indoors({{.near = 1979, .far = 21}}));
  CHECK(indoors({{.near_m = 29.9F}}));
  CHECK_FALSE(indoors({{.near_m = 30.1F}}));
  CHECK(estimate({{.near_m = 12.1F}}).extent_m == 12.25F);
  CHECK(estimate({}).surroundings == Surroundings::kOutdoors);
}

TEST_CASE("Points count however far away they are") {
  for (const float far_m : {127.0F, 128.0F, 129.0F, 240.0F, 1e9F}) {
    CAPTURE(far_m);
    CHECK_FALSE(indoors({{.near = 1900, .far = 100, .far_m = far_m}}));
    CHECK(estimate({{.near = 1900, .far = 100, .far_m = far_m}}).extent_m > 126.0F);
    CHECK(indoors({{.far_m = far_m}}));
  }
}

TEST_CASE("One scan that sees far is enough for outdoors, in whatever order they come") {
  const Ring room;
  const Ring street{.near_m = 40.0F};
  CHECK(indoors({room, room, room}));
  CHECK_FALSE(indoors({street, room, room}));
  CHECK_FALSE(indoors({room, room, street}));
  CHECK(estimate({room, street, room}).extent_m == 40.25F);
  CHECK(estimate({room, street, room}).scans == 3);
}

TEST_CASE("A LiDAR that does not see all round never says indoors") {
  CHECK_FALSE(indoors({{.to_deg = 70.0F}}));
  CHECK_FALSE(estimate({{.to_deg = 70.0F}}).sees_all_round);
  CHECK_FALSE(indoors({{.to_deg = 310.0F}}));
  CHECK(estimate({{}}).sees_all_round);
}

TEST_CASE("Points that are none, of the robot itself or not finite do not count") {
  std::vector<Eigen::Vector3f> points = scan({.near_m = 31.0F});
  points.resize(6000, Eigen::Vector3f(0.1F, 0.0F, 0.0F));
  points.resize(12000, Eigen::Vector3f::Zero());
  points.resize(18000, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  points.resize(24000, Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()));
  SurroundingsEstimator estimator;
  add(estimator, points);
  CHECK(estimator.estimate().extent_m == Approx(31.25F));
  CHECK(estimator.estimate().surroundings == Surroundings::kOutdoors);
}

TEST_CASE("A scan with few points is passed over") {
  CHECK(estimate({{.near = 990, .far = 9}}).scans == 0);
  CHECK_FALSE(indoors({{.near = 990, .far = 9}}));
  CHECK(indoors({{.near = 990, .far = 10}}));
  CHECK(indoors({{}, {.near = 10, .near_m = 90.0F, .far = 0}}));
}

TEST_CASE("The indoor setting is valid for every sensor and computer and takes no more memory") {
  for (const SensorModel& model : sensor_models()) {
    for (const Computer computer :
         {Computer::kServer, Computer::kJetson, Computer::kRaspberryPi, Computer::kArmv7With64Mb}) {
      CAPTURE(std::string(model.name), static_cast<int>(computer));
      const PipelineConfig outdoors = preset(model.kind, computer);
      const PipelineConfig room = adapt_to(Surroundings::kIndoors, outdoors, 0.5F);
      CHECK(room.validate().code == ErrorCode::kOk);
      CHECK(Pipeline::required_bytes(room) <= Pipeline::required_bytes(outdoors));
      CHECK(room.keyframe.scans < outdoors.keyframe.scans);
      CHECK(room.descriptor.column_size_m < outdoors.descriptor.column_size_m);
      CHECK(room.descriptor.suppression_radius_m < outdoors.descriptor.suppression_radius_m);
      CHECK(room.loop_search.triangles.min_side_m < outdoors.loop_search.triangles.min_side_m);
      // Places of both kinds of sessions fit one database.
      CHECK(room.place_shape().voxel_size_m == outdoors.place_shape().voxel_size_m);
      CHECK(room.place_shape().max_keypoints == outdoors.place_shape().max_keypoints);
      const PipelineConfig same = adapt_to(Surroundings::kOutdoors, outdoors);
      CHECK(same.keyframe.scans == outdoors.keyframe.scans);
      CHECK(same.descriptor.column_size_m == outdoors.descriptor.column_size_m);
    }
  }
}

TEST_CASE("Indoors a keyframe lasts no longer than 2.5 s, but has five scans or more") {
  const PipelineConfig outdoors = preset(SensorKind::kVlp16);
  REQUIRE(outdoors.keyframe.scans == 10);
  const auto scans = [&](float interval_s) {
    return adapt_to(Surroundings::kIndoors, outdoors, interval_s).keyframe.scans;
  };
  CHECK(scans(0.05F) == 10);
  CHECK(scans(0.1F) == 10);
  CHECK(scans(0.25F) == 10);
  CHECK(scans(0.26F) == 9);
  CHECK(scans(0.5F) == 5);
  CHECK(scans(2.0F) == 5);
  CHECK(adapt_to(Surroundings::kIndoors, outdoors).keyframe.scans == 10);
  CHECK(adapt_to(Surroundings::kOutdoors, outdoors, 2.0F).keyframe.scans == 10);
}
