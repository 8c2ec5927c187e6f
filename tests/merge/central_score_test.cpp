// Suitability as the central map, one quality at a time: the others are nothing in every session
#include "src/merge/sessions/central_score.hpp"

#include "src/core/image_code.hpp"
#include "tests/merge/poses.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

SessionData session_of(std::size_t keyframes) {
  SessionData session;
  session.keyframes.resize(keyframes);
  for (KeyframeRecord& keyframe : session.keyframes) keyframe.scans.resize(1);
  return session;
}

/// A cell of structure at a position of the odometry frame; a single one is no field of view.
void see(KeyframeRecord& keyframe, double x, double y, double z) {
  const Eigen::Vector3d p = keyframe.T_odometry_keyframe.inverse() * Eigen::Vector3d(x, y, z);
  keyframe.static_cells.push_back({p.cast<float>(), 3, 0, 0});
}

LoopConstraint loop(std::size_t session, std::size_t query, std::size_t match, bool accepted) {
  LoopConstraint made;
  made.query = {session, query};
  made.match = {session, match};
  made.decision.accepted = accepted;
  return made;
}

}  // namespace

TEST_CASE("A session's coverage is the ground plan of its structure, each square counted once",
          "[central]") {
  std::vector<SessionData> sessions{session_of(2), session_of(3)};
  for (const double x : {2.0, 13.0, 22.0, 31.0}) see(sessions[0].keyframes[0], x, 2.0, 2.0);
  // Seen again by another keyframe that is elsewhere and turned, and at another height.
  sessions[0].keyframes[1].T_odometry_keyframe = yaw_pose(1.5707963267948966, {20.0, 10.0, 0.0});
  for (const double x : {2.0, 13.0, 22.0, 31.0}) see(sessions[0].keyframes[1], x, 2.0, 8.0);
  for (std::size_t k = 0; k < 3; ++k) {
    see(sessions[1].keyframes[k], 10.0 * static_cast<double>(k) + 2.0, -8.0, 2.0);
  }
  const std::vector<double> scores = central_scores(sessions, {});
  CHECK(scores[0] == Approx(0.35));
  CHECK(scores[1] == Approx(0.35 * 3.0 / 4.0));
}

TEST_CASE("Of a session's keyframes those count that lie within its accepted loops", "[central]") {
  const std::vector<SessionData> sessions{session_of(10), session_of(8), session_of(5)};
  const std::vector<LoopConstraint> loops{loop(0, 6, 2, true),  loop(0, 4, 3, true),
                                          loop(0, 9, 0, false), loop(1, 7, 0, false),
                                          loop(1, 0, 3, true),  loop(1, 6, 6, true)};
  const std::vector<double> scores = central_scores(sessions, loops);
  // 5 of 10, 5 of 8, none.
  CHECK(scores[0] == Approx(0.25 * 0.5 / 0.625));
  CHECK(scores[1] == Approx(0.25));
  CHECK(scores[2] == 0.0);
}

TEST_CASE("A session is as rich as its median keyframe in keypoints", "[central]") {
  std::vector<SessionData> sessions{session_of(3), session_of(1)};
  const std::size_t counts[] = {40, 10, 12};
  for (std::size_t k = 0; k < 3; ++k) sessions[0].keyframes[k].keypoints.resize(counts[k]);
  sessions[1].keyframes[0].keypoints.resize(48);
  const std::vector<double> scores = central_scores(sessions, {});
  CHECK(scores[0] == Approx(0.20 * 12.0 / 48.0));
  CHECK(scores[1] == Approx(0.20));
}

TEST_CASE("A field of view counts by its solid angle", "[central]") {
  // All around and a third of it; over the same elevations and up to 30 degrees only.
  const RangeImageShape shapes[] = {{360.0F, 2.0F, -30.0F, 90.0F, 2.0F},
                                    {120.0F, 2.0F, -30.0F, 90.0F, 2.0F},
                                    {360.0F, 2.0F, -30.0F, 30.0F, 2.0F}};
  std::vector<SessionData> sessions;
  for (const RangeImageShape& shape : shapes) {
    KeyframeRecord& keyframe = sessions.emplace_back(session_of(1)).keyframes[0];
    const std::vector<std::uint16_t> pixels(ImageProjection(shape).pixels(), 1000);
    keyframe.image_shape = shape;
    keyframe.images.resize(1);
    keyframe.images[0].code.resize(max_image_code(pixels.size()));
    keyframe.images[0].code.resize(encode_image(pixels, keyframe.images[0].code));
  }
  const std::vector<double> scores = central_scores(sessions, {});
  CHECK(scores[0] == Approx(0.20));
  CHECK(scores[1] == Approx(0.20 / 3.0));
  CHECK(scores[2] == Approx(0.20 * 2.0 / 3.0));
}

TEST_CASE("A session without keyframes is worth nothing as the central map", "[central]") {
  std::vector<SessionData> sessions{session_of(0), session_of(1)};
  CHECK(central_scores(sessions, {}) == std::vector<double>{0.0, 0.0});
  CHECK(central_scores({}, {}).empty());
}
