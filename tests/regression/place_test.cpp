// Places of three sessions seen from tilted sensors, and the search among them
#include "expected_text.hpp"
#include "tests/place/synthetic_place.hpp"
#include "tests/test.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/describer.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

/// A place that outlives the describer's next one.
struct OwnedPlace {
  KeyframeId id;
  Pose T_session_place;
  KeyframeUp up;
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;

  [[nodiscard]] PlaceView view() const { return {keypoints, planes, up}; }
};

DescriptorConfig descriptor_config() {
  DescriptorConfig config;
  config.max_keypoints = 60;
  config.max_planes = 300;
  config.max_voxels = 3000;
  config.range_m = 40.0F;
  config.column_size_m = 0.35F;
  config.window_m = 0.6F;
  config.suppression_radius_m = 1.6F;
  config.max_candidates = 500;
  return config;
}

LoopSearchConfig search_config() {
  LoopSearchConfig config;
  config.max_places = 12;
  config.max_results = 6;
  config.triangles.neighbours = 9;
  config.triangles.min_side_m = 3.0F;
  config.triangles.max_side_m = 30.0F;
  config.triangles.max_triangles = 300;
  config.side_tolerance_m = 0.25F;
  config.max_code_difference = 7;
  config.max_bucket = 400;
  config.max_candidates = 20;
  config.max_verified = 6;
  config.accept_confidence = 0.8F;
  return config;
}

/// Three robots in one scene; of the second nothing tells how level its frames are.
std::vector<OwnedPlace> make_places(PlaceDescriber& describer, std::string& text) {
  const std::vector<test::Surface> scene = test::make_scene(17);
  std::vector<OwnedPlace> places;
  for (std::uint32_t session = 0; session < 3; ++session) {
    for (std::uint32_t k = 0; k < 6; ++k) {
      const double x = -9.0 + 3.5 * k + 1.3 * session;
      const double y = 4.0 - 2.2 * k - 0.7 * session;
      Pose sensor = test::standing_at(x, y, 1.4 + 0.2 * session, 0.9 * k + 2.0 * session);
      // The vehicle leans; the description is of the levelled frame.
      const Eigen::AngleAxisd lean(0.05 + 0.02 * k, Eigen::Vector3d(0.6, -0.8, 0.0));
      sensor.rotation = sensor.rotation * lean.toRotationMatrix();
      test::View view;
      view.noise_seed = 100 * session + k;
      view.spacing_m = 0.17;
      view.range_m = 45.0;
      view.noise_m = 0.015;
      view.grid_shift = {0.07 * k, -0.05, 0.03 * session};
      const PlaceView found = describer.describe(test::observe(scene, sensor, view));
      OwnedPlace place;
      place.id = {session, 10 * k};
      place.T_session_place = level_frame(sensor);
      place.T_session_place.translation += Eigen::Vector3d(100.0 * session, -50.0, 3.0 * session);
      if (session != 1) place.up = {true, 3e-5F, 1e-5F, 5e-5F};
      place.keypoints.assign(found.keypoints.begin(), found.keypoints.end());
      place.planes.assign(found.planes.begin(), found.planes.end());
      CloudMoments planes;
      CloudMoments normals;
      for (const PlanePatch& plane : place.planes) {
        planes.add(plane.center);
        normals.add(plane.normal);
      }
      text += line_of("place", session, place.id.keyframe, "dropped", describer.dropped()) +
              keypoints_text(place.keypoints) + line_of("  planes", planes) +
              line_of("  normals", normals);
      places.push_back(std::move(place));
    }
  }
  return places;
}

/// Stores all places, and searches for every other one in every scope.
void search_all(const std::vector<OwnedPlace>& places, const LoopSearchConfig& config,
                const PlaceShape& shape, std::string& text) {
  Owned<PlaceDatabase> database(config, shape);
  REQUIRE(database.ok());
  for (const OwnedPlace& place : places) {
    database->insert(place.view(), place.id, place.T_session_place);
    text += line_of("stored", database->size(), "evicted", database->evicted(), "dropped",
                    database->dropped());
  }
  const SearchScope scopes[] = {{SearchScope::Sessions::kAll, 15},
                                {SearchScope::Sessions::kOnlySame, 10},
                                {SearchScope::Sessions::kOnlyOther, 0}};
  for (const SearchScope& scope : scopes) {
    for (std::size_t i = 0; i < places.size(); i += 2) {
      text += line_of("search for", places[i].id.session, places[i].id.keyframe, "in",
                      kSearchSessions[static_cast<std::size_t>(scope.sessions)]);
      for (const LoopCandidate& loop : database->search(places[i].view(), places[i].id, scope)) {
        text += line_of("  found", loop.match.session, loop.match.keyframe, "confidence",
                        fixed(loop.confidence, 4), loop.accepted ? "accepted" : "refused", "votes",
                        loop.votes, "inliers", loop.inliers, "planes", fixed(loop.plane_overlap, 4),
                        loop.T_match_query);
      }
      text += line_of("  dropped", database->dropped());
    }
  }
}

}  // namespace

TEST_CASE("places and the search among them, as before on every platform", "[regression]") {
  std::string text;
  Owned<PlaceDescriber> describer(descriptor_config(), DescriptorInput{2.0F, 1U << 16U});
  REQUIRE(describer.ok());
  const std::vector<OwnedPlace> places = make_places(*describer, text);
  search_all(places, search_config(), {50, 250, 2.0F}, text);
  LoopSearchConfig tight = search_config();
  tight.max_places = 15;
  tight.max_results = 3;
  tight.triangles.max_triangles = 150;
  tight.max_bucket = 20;
  tight.max_compared = 3000;
  tight.max_matches = 400;
  tight.max_candidates = 8;
  tight.max_per_session = 1;
  tight.max_verified = 3;
  text += "tight\n";
  search_all(places, tight, {30, 100, 2.0F}, text);
  check_expected("places", text);
}
