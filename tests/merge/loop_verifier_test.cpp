// Loop verification: every gate just passed, and just missed with its reason
#include "src/merge/loops/loop_verifier.hpp"

#include "src/core/tilt_prior.hpp"
#include "src/merge/registration/overlap_distances.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

Pose tilted(double deg) { return turned_about(Eigen::Vector3d::UnitX(), deg / kDegreesPerRadian); }

/// Cells of a yard in the frame of a given pose: walls with points 15 cm apart, and ground.
class View {
 public:
  explicit View(const Pose& T_world_keyframe, std::uint64_t seed = 1)
      : T_keyframe_world_(T_world_keyframe.inverse()), random_(seed) {}

  void add_wall(double x0, double y0, double x1, double y1, double z0, double z1) {
    const int steps = static_cast<int>(std::hypot(x1 - x0, y1 - y0) / 0.15);
    for (int i = 0; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      for (double z = z0; z < z1; z += 0.15) add({x0 + s * (x1 - x0), y0 + s * (y1 - y0), z}, 0);
    }
  }

  void add_ground() {
    for (double x = -14.0; x < 14.0; x += 0.4) {
      for (double y = -10.0; y < 10.0; y += 0.4) add({x, y, -1.7}, 1);
    }
  }

  /// Four walls without symmetry, two pillars, ground.
  void add_yard() {
    add_wall(-15.0, 10.0, 15.0, 10.0, -1.6, 3.0);
    add_wall(15.0, -10.0, 15.0, 10.0, -1.6, 3.0);
    add_wall(-15.0, -10.0, -15.0, 10.0, -1.6, 3.0);
    add_wall(-15.0, -10.0, 4.0, -10.0, -1.6, 3.0);
    add_wall(7.0, 8.0, 8.0, 8.0, -1.6, 3.0);
    add_wall(-9.0, -7.0, -9.0, -6.0, -1.6, 3.0);
    add_ground();
  }

  [[nodiscard]] const KeyframeRecord& keyframe() const { return keyframe_; }

 private:
  void add(const Eigen::Vector3d& p, std::uint8_t ground) {
    const Eigen::Vector3d own = T_keyframe_world_ * p + random_.normal3(0.01);
    keyframe_.static_cells.push_back({own.cast<float>(), 3, ground, 0});
  }

  Pose T_keyframe_world_;
  Random random_;
  KeyframeRecord keyframe_;
};

std::vector<SessionData> two_sessions(const View& match, const View& query) {
  std::vector<SessionData> sessions(2);
  sessions[0].keyframes.push_back(match.keyframe());
  sessions[1].keyframes.push_back(query.keyframe());
  return sessions;
}

/// The match stands at the origin, the query at `T_match_query`, and both see the yard.
std::vector<SessionData> yard_from(const Pose& T_match_query) {
  View match{Pose{}};
  View query{T_match_query, 2};
  match.add_yard();
  query.add_yard();
  return two_sessions(match, query);
}

constexpr CorrectionLimit kGenerous{4.0, 0.25};

LoopCandidate proposed(const Pose& T_match_query) {
  LoopCandidate candidate;
  candidate.query = {1, 0};
  candidate.match = {0, 0};
  candidate.T_match_query = T_match_query;
  return candidate;
}

LoopConstraint verify(const std::vector<SessionData>& sessions, const Pose& T_match_query,
                      const MergeConfig& config = {}, const CorrectionLimit& limit = kGenerous) {
  const LoopCandidate candidate = proposed(T_match_query);
  KeyframeClouds clouds(sessions, config.registration, 1);
  return verify_loops({&candidate, 1}, limit, clouds, config).front();
}

/// The figure in a reason such as "overlap 0.42 (limit 0.45)", which is what `begins` it.
double measured(const LoopConstraint& loop, const std::string& begins) {
  INFO(loop.decision.reason);
  REQUIRE_FALSE(loop.decision.accepted);
  REQUIRE(loop.decision.reason.rfind(begins + " ", 0) == 0);
  return std::stod(loop.decision.reason.substr(begins.size()));
}

const Pose kTruth = yaw_pose(0.3, {1.5, -0.5, 0.0});

/// The yard with both keyframes' up known to `sigma_deg`.
std::vector<SessionData> yard_known(const Pose& T_match_query, double sigma_deg) {
  const auto variance = static_cast<float>(std::pow(sigma_deg / kDegreesPerRadian, 2));
  auto sessions = yard_from(T_match_query);
  for (SessionData& session : sessions) session.keyframes[0].up = {true, variance, 0.0F, variance};
  return sessions;
}

/// What registration alone is allowed to tilt a pose, degrees.
constexpr double kRegistrationDeg = 0.5;

/// Half of what each sees, the other does not: walls at different positions outside the view.
std::array<View, 2> half_of_each() {
  std::array<View, 2> views{View{Pose{}}, View{kTruth, 2}};
  for (View& view : views) view.add_yard();
  for (const double beyond : {16.0, 18.0, 20.0}) {
    views[0].add_wall(-20.0, beyond, 14.0, beyond, -1.6, 3.0);
    views[1].add_wall(-14.0, -beyond, 20.0, -beyond, -1.6, 3.0);
  }
  return views;
}

}  // namespace

TEST_CASE("Keyframes that know up must agree on it", "[verification]") {
  const Pose leaning = kTruth * tilted(2.9);
  auto sessions = yard_from(leaning);
  CHECK(verify(sessions, leaning).decision.accepted);

  constexpr KeyframeUp kSure{true, 1e-5F, 0.0F, 1e-5F};  // 0.2 degrees
  sessions[0].keyframes[0].up = kSure;
  CHECK(verify(sessions, leaning).decision.accepted);
  sessions[1].keyframes[0].up = kSure;
  CHECK(measured(verify(sessions, leaning), "tilt in sigmas") > 4.0);
  // Less certain about the axis around which they disagree.
  sessions[1].keyframes[0].up = {true, 1e-5F, 0.0F, 1e-3F};
  CHECK(verify(sessions, leaning).decision.accepted);

  auto level = yard_from(kTruth);
  level[0].keyframes[0].up = level[1].keyframes[0].up = kSure;
  CHECK(verify(level, kTruth).decision.accepted);
}

TEST_CASE("A loop may be tilted by four sigma of both keyframes' up", "[verification]") {
  const double sigma = GENERATE(0.3, 0.6, 1.0);
  const double limit_deg = 4.0 * std::hypot(sigma, sigma, kRegistrationDeg);
  const auto at = [&](double deg) {
    const Pose pose = kTruth * tilted(deg);
    return verify(yard_known(pose, sigma), pose);
  };
  const LoopConstraint inside = at(limit_deg - 0.2);
  CHECK(inside.decision.accepted);
  // The pose carries the tilt: it is not projected to the prior's mean.
  const double found = std::asin(tilt_of(inside.T_match_query).norm()) * kDegreesPerRadian;
  CHECK(found == Approx(limit_deg - 0.2).margin(0.1));
  CHECK(measured(at(limit_deg + 0.2), "tilt in sigmas") ==
        Approx(4.0 * (limit_deg + 0.2) / limit_deg).epsilon(0.04));
}

TEST_CASE("Where up is unknown both keyframes are up within 1.25 degrees", "[verification]") {
  const double limit_deg = 4.0 * std::hypot(1.25, 1.25, kRegistrationDeg);
  const auto at = [&](double deg) {
    const Pose pose = kTruth * tilted(deg);
    return verify(yard_from(pose), pose);
  };
  CHECK(at(limit_deg - 0.2).decision.accepted);
  CHECK(measured(at(limit_deg + 0.2), "tilt in sigmas") > 4.0);
}

TEST_CASE("A true loop is confirmed, its pose corrected", "[verification]") {
  const auto sessions = yard_from(kTruth);
  const LoopConstraint loop = verify(sessions, kTruth * shifted(0.4, 0.3));
  CHECK(loop.decision.accepted);
  CHECK(loop.decision.reason.empty());
  CHECK(apart_m(loop.T_match_query, kTruth) < 0.05);
  CHECK(loop.overlap > 0.9);
}

TEST_CASE("A candidate that is no rigid transform is refused", "[verification]") {
  Pose sheared;
  sheared.rotation(0, 1) = 0.5;
  CHECK(verify(yard_from(Pose{}), sheared).decision.reason ==
        "the proposed pose is no rigid transform");
}

TEST_CASE("Alignment levels a candidate that is tilted beyond what up allows", "[verification]") {
  const LoopConstraint loop = verify(yard_known(kTruth, 0.5), kTruth * tilted(8.0));
  CHECK(loop.decision.accepted);
  CHECK(apart_m(loop.T_match_query, kTruth) < 0.05);
}

TEST_CASE("Structure must coincide before alignment is tried", "[verification]") {
  const auto sessions = yard_from(kTruth);
  const MergeConfig config;
  KeyframeClouds clouds(sessions, config.registration, 1);
  // The more a candidate is turned, the less of the walls coincides.
  double least_tried = 1.0;
  double most_refused = 0.0;
  for (double turn = 0.0; turn < 1.0; turn += 0.02) {
    const LoopCandidate candidate = proposed(kTruth * yaw_pose(turn));
    const double overlap =
        structure_overlap(*clouds.cloud(candidate.match), *clouds.cloud(candidate.query),
                          candidate.T_match_query, kOverlapRadiusM, kCoarseDistanceM);
    const LoopConstraint loop = verify_loops({&candidate, 1}, kGenerous, clouds, config).front();
    if (loop.decision.reason.rfind("overlap before alignment", 0) == 0) {
      most_refused = std::max(most_refused, overlap);
    } else {
      least_tried = std::min(least_tried, overlap);
    }
  }
  CHECK(least_tried >= 0.3);
  CHECK(least_tried < 0.35);
  CHECK(most_refused < 0.3);
  CHECK(most_refused > 0.25);
}

TEST_CASE("An alignment that runs out of iterations is refused", "[verification]") {
  const auto sessions = yard_from(kTruth);
  MergeConfig config;
  config.registration.max_iterations = 2;
  CHECK(verify(sessions, kTruth * shifted(0.8), config).decision.reason ==
        "alignment did not converge");
}

TEST_CASE("Alignment may move and turn a candidate up to the limits", "[verification]") {
  const auto sessions = yard_from(kTruth);
  const Pose moved = kTruth * shifted(0.6, 0.8);
  CHECK(verify(sessions, moved, {}, {1.1, 0.25}).decision.accepted);
  CHECK(measured(verify(sessions, moved, {}, {0.9, 0.25}), "alignment moved it by metres") ==
        Approx(1.0).margin(0.06));
  const Pose turned = kTruth * yaw_pose(0.08);
  CHECK(verify(sessions, turned, {}, {4.0, 0.09}).decision.accepted);
  CHECK(measured(verify(sessions, turned, {}, {4.0, 0.07}), "alignment turned it by radians") ==
        Approx(0.08).margin(0.011));
}

TEST_CASE("Structure must coincide after alignment", "[verification]") {
  std::array<View, 2> views = half_of_each();
  // What both see in common disagrees, so that only overlap speaks for the loop.
  for (const double y : {-7.5, -5.0, -2.5, 2.5, 5.0, 7.0}) {
    views[0].add_wall(-12.0, y, 12.0, y, -1.6, 3.0);
  }
  const auto sessions = two_sessions(views[0], views[1]);
  MergeConfig config;
  config.loops.max_contradiction = 0.4;
  REQUIRE(measured(verify(sessions, kTruth, config), "structure in free space") > 0.4);
  config.loops.max_contradiction = 1.0;
  config.loops.min_overlap = 1.0;
  const double overlap = measured(verify(sessions, kTruth, config), "overlap");
  REQUIRE(overlap < 0.95);
  config.loops.min_overlap = overlap + 0.01;
  CHECK(measured(verify(sessions, kTruth, config), "overlap") == overlap);
  config.loops.min_overlap = overlap - 0.01;
  CHECK(verify(sessions, kTruth, config).decision.accepted);
}

TEST_CASE("Two thirds of the overlap are enough where the common view agrees", "[verification]") {
  const std::array<View, 2> views = half_of_each();
  const auto sessions = two_sessions(views[0], views[1]);
  MergeConfig config;
  const double overlap = verify(sessions, kTruth, config).overlap;
  REQUIRE(overlap < 0.65);
  config.loops.min_overlap = 1.5 * (overlap + 0.01);
  CHECK(measured(verify(sessions, kTruth, config), "overlap") == Approx(overlap).margin(0.005));
  config.loops.min_overlap = 1.5 * (overlap - 0.01);
  CHECK(verify(sessions, kTruth, config).decision.accepted);
}

TEST_CASE("A false loop whose structure stands in the other's free space is refused",
          "[verification]") {
  // Both yards have the same walls; one has screens all around where the other saw through.
  View match{Pose{}};
  View query{kTruth, 2};
  match.add_yard();
  query.add_yard();
  const bool screens_of_match = GENERATE(false, true);
  View& screened = screens_of_match ? match : query;
  for (const double y : {-5.0, 5.0}) screened.add_wall(-6.0, y, 6.0, y, -1.2, 1.5);
  for (const double x : {-6.0, 6.0}) screened.add_wall(x, -4.0, x, 4.0, -1.2, 1.5);
  const auto sessions = two_sessions(match, query);
  MergeConfig config;
  config.loops.max_contradiction = 0.05;
  const double share = measured(verify(sessions, kTruth, config), "structure in free space");
  CHECK(share > 0.15);
  config.loops.max_contradiction = share + 0.01;
  CHECK(verify(sessions, kTruth, config).decision.accepted);
  config.loops.max_contradiction = share - 0.01;
  CHECK(measured(verify(sessions, kTruth, config), "structure in free space") == share);
}

TEST_CASE("Loops are verified in the candidates' order whatever the number of threads",
          "[verification]") {
  const auto sessions = yard_from(kTruth);
  std::vector<LoopCandidate> candidates;
  for (std::size_t i = 0; i < 7; ++i) {
    candidates.push_back(proposed(kTruth * shifted(0.1 * static_cast<double>(i)) *
                                  yaw_pose(i % 3 == 2 ? 0.8 : 0.0)));
  }
  MergeConfig config;
  config.threads = 3;
  KeyframeClouds clouds(sessions, config.registration, 3);
  const auto verified = verify_loops(candidates, kGenerous, clouds, config);
  REQUIRE(verified.size() == candidates.size());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    CHECK(verified[i].decision.accepted == (i % 3 != 2));
    CHECK(verified[i].decision.reason.rfind(i % 3 == 2 ? "overlap before alignment" : "", 0) == 0);
  }
}
