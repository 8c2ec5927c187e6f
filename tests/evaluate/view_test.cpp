// Tests of the evaluation that a map's page shows.
#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/view/evaluation_files.hpp"
#include "src/apps/view/map_files.hpp"
#include "tests/evaluate/small_folders.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/view/gunzip.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

constexpr double kTooHighM = 0.3;

/// Two sessions round one circle, a keyframe a scan, in a map that is turned and far away.
struct EvaluatedMap {
  TemporaryDirectory folder;
  Pose T_map_truth{Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                   {50, 60, 7}};
  EvaluateViewOptions options;

  explicit EvaluatedMap(const std::string& loops = "") {
    // Kept but dynamic, removed but static, and four with the right label or none.
    write_dataset(
        folder / "data", circle(),
        {{5, 0, 0, 0}, {0, 5, 0, 0}, {0, -5, 0, 0}, {0, 0, 5, 0}, {3, 3, 3, 0}, {4, 4, 4, 0}},
        {252, 50, 252, 50, 0, 0});
    write_run_labels(folder / "run", 30, {9, 251, 251, 9, 9, 251});
    write_map(folder / "map", {{"a", "central"}, {"b", "merged"}}, circle(), T_map_truth,
              kTooHighM);
    write_lines(folder / "map/loops.csv", kLoopsHeader + loops);
    Json map = {{"version", "0"}, {"layers", Json::object()}};
    for (const double z_m : {0.0, kTooHighM}) {
      Json session = {{"name", z_m > 0.0 ? "b" : "a"}, {"start_s", 0.0}};
      for (int k = 0; k < 30; ++k) {
        const Eigen::Vector3d p = T_map_truth * circle()[k].translation;
        session["sequences"].push_back(k);
        session["stamps_s"].push_back(0.1 * k);
        session["poses"].push_back({p.x(), p.y(), p.z() + z_m, 0, 0, 0, 1});
      }
      map["sessions"].push_back(session);
    }
    std::filesystem::create_directories(folder / "map/view");
    write_lines(folder / "map/view/map.json", map.dump());
    options.map = folder / "map";
    for (const char* name : {"a", "b"}) {
      options.truths.emplace_back(name, folder / "data");
      options.runs.emplace_back(name, folder / "run");
    }
  }

  [[nodiscard]] Json shown() const {
    return Json::parse(*FolderView(folder / "map/view").map_json(0));
  }
};

/// All points of a layer, by session, as the page decodes them.
std::array<std::vector<Eigen::Vector3d>, 2> points_of(const EvaluatedMap& map,
                                                      const std::string& layer) {
  std::array<std::vector<Eigen::Vector3d>, 2> points;
  FolderView view(map.folder / "map/view");
  const Json json = map.shown();
  for (const Json& node : json["layers"][layer]["nodes"]) {
    const std::string bytes =
        gunzip(*view.block(json["version"], layer, node[0].get<std::string>()));
    const auto count = number_at<std::uint32_t>(bytes, 8);
    const auto step = static_cast<double>(number_at<float>(bytes, 24));
    for (std::uint32_t i = 0; i < count; ++i) {
      Eigen::Vector3d point;
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        const auto origin = static_cast<double>(number_at<float>(bytes, 12 + 4 * axis));
        const auto at = number_at<std::uint16_t>(bytes, 28 + 2 * (axis * count + i));
        point[axis] = origin + step * at;
      }
      points.at(number_at<std::uint8_t>(bytes, 28 + 6 * count + i)).push_back(point);
    }
  }
  return points;
}

/// A point of the sensor's frame is shown where it truly is in all scans, and nothing else is.
void check_layer(const EvaluatedMap& map, const std::string& layer, const Eigen::Vector3d& point) {
  const auto is_near = [](const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& place,
                          double reach_m) {
    return std::any_of(points.begin(), points.end(),
                       [&](const auto& p) { return (p - place).norm() <= reach_m; });
  };
  const auto shown = points_of(map, layer);
  for (const std::size_t session : {0U, 1U}) {
    std::vector<Eigen::Vector3d> places;
    for (const Pose& pose : circle()) {
      places.push_back(map.T_map_truth * (pose * point));
      if (session == 1) places.back().z() += kTooHighM;
    }
    CHECK(shown[session].size() >= 25);  // 30 scans; some places share a voxel
    for (const Eigen::Vector3d& p : shown[session]) CHECK(is_near(places, p, 0.01));
    for (const Eigen::Vector3d& place : places) CHECK(is_near(shown[session], place, 0.36));
  }
}

}  // namespace

TEST_CASE("points with the wrong label are where the map has them, and nowhere else") {
  EvaluatedMap map;
  const Json printed = Json::parse(evaluate_view(map.options));
  CHECK(printed["summary"]["false_static_points"] == 60);
  CHECK(printed["summary"]["false_dynamic_points"] == 60);
  CHECK(printed["summary"]["SA_percent"] == 50.0);
  CHECK(printed["sessions"][1]["DA_percent"] == 50.0);
  check_layer(map, "false_static", {5, 0, 0});
  check_layer(map, "false_dynamic", {0, 5, 0});
}

TEST_CASE("right labels make no layer of wrong points") {
  EvaluatedMap map;
  write_run_labels(map.folder / "run", 30, {251, 9, 251, 9, 9, 251});
  const Json printed = Json::parse(evaluate_view(map.options));
  CHECK(printed["summary"]["AA_percent"] == 100.0);
  CHECK_FALSE(map.shown()["layers"].contains("false_static"));
  CHECK_FALSE(map.shown()["layers"].contains("false_dynamic"));
}

TEST_CASE("the position error is that of each keyframe after the central session is aligned") {
  EvaluatedMap map;
  (void)evaluate_view(map.options);
  const Json evaluation = map.shown()["evaluation"];
  REQUIRE(evaluation["ate_m"].size() == 2);
  REQUIRE(evaluation["ate_m"][1].size() == 30);
  for (const Json& error : evaluation["ate_m"][0]) {
    CHECK(error.get<double>() == Approx(0.0).margin(1e-3));
  }
  for (const Json& error : evaluation["ate_m"][1]) CHECK(error.get<double>() == Approx(kTooHighM));
  CHECK(evaluation["sessions"][1]["ATE_rmse_m"].get<double>() == Approx(kTooHighM));
}

TEST_CASE("loops of all sessions make one curve, whichever of two was searched for") {
  const std::string to = ",reason,0,0,0,0,0,0,1\n";
  EvaluatedMap map("b,3,3,a,3,3,0.9,1" + to + "a,7,7,b,7,7,0.7,1" + to + "b,5,5,a,20,20,0.5,1" +
                   to);
  const Json summary = Json::parse(evaluate_view(map.options))["summary"];
  CHECK(summary["keyframes_with_a_right_loop"] == 2);
  CHECK(summary["keyframes_with_a_wrong_loop"] == 1);
  CHECK(summary["keyframes_that_revisit"] == 30);
  const Json curve = map.shown()["evaluation"]["precision_recall"];
  REQUIRE(curve.size() == 3);
  CHECK(curve[1][0] == 1.0);
  CHECK(curve[1][1].get<double>() == Approx(2.0 / 30).margin(1e-4));
  CHECK(curve[2][0].get<double>() == Approx(2.0 / 3).margin(1e-4));
}

TEST_CASE("what is not evaluated is said") {
  EvaluatedMap map;
  map.options.runs.pop_back();
  std::vector<Pose> truth = circle();
  truth.push_back(at(100));  // no scan of the map
  write_dataset(map.folder / "data", truth, {{5, 0, 0, 0}}, {252});
  write_run_labels(map.folder / "run", 31, {9});
  const std::string notes = Json::parse(evaluate_view(map.options))["notes"].dump();
  CHECK_THAT(notes, Contains("a: 1 of 31 scans have no pose in the map"));
  CHECK_THAT(notes, Contains("b: no labels were named"));
  CHECK(points_of(map, "false_static")[0].size() <= 30);
  CHECK(points_of(map, "false_static")[1].empty());

  map.options.truths.pop_back();
  map.options.replaces = true;
  CHECK_THAT(Json::parse(evaluate_view(map.options))["notes"].dump(),
             Contains("b: no truth was named"));
  CHECK(map.shown()["evaluation"]["ate_m"][1].empty());
}

TEST_CASE("an evaluation is refused in words where it does not fit, and replaced where told to") {
  EvaluatedMap map;
  (void)evaluate_view(map.options);
  const std::string version = map.shown()["version"];
  CHECK_THROWS_WITH(evaluate_view(map.options), Contains("--replace overwrites it"));
  map.options.replaces = true;
  write_run_labels(map.folder / "run", 30, {9, 251, 9, 9, 9, 251});
  (void)evaluate_view(map.options);
  CHECK(map.shown()["version"] != version);
  map.options.runs.emplace_back("c", map.folder / "run");
  CHECK_THROWS_WITH(evaluate_view(map.options), Contains("--run names session \"c\""));
  map.options.runs.pop_back();
  write_lines(map.folder / "map/view/evaluation.json", R"({"evaluation": 3})");
  CHECK_THROWS_WITH(FolderView(map.folder / "map/view"), Contains("is no evaluation of this map"));
  write_lines(map.folder / "map/view/map.json", R"({"sessions": [{"name": "a"}]})");
  CHECK_THROWS_WITH(evaluate_view(map.options), Contains("map.json"));
}

TEST_CASE("a report gets the evaluation, once") {
  EvaluatedMap map;
  const auto report = map.folder / "map/report.html";
  write_lines(report, page_with({map.shown().dump(), {}, {}}, 1'000'000));
  (void)evaluate_view(map.options);
  const auto text = [&] { return datasets::read_file(report); };
  const std::string once = text();
  CHECK_THAT(once, Contains("id=\"points/false_static/r\"") &&
                       Contains("id=\"points/false_dynamic/r\"") && Contains("\"ate_m\""));
  map.options.replaces = true;
  (void)evaluate_view(map.options);
  CHECK(text() == once);
  write_lines(report, "no page");
  CHECK_THROWS_WITH(evaluate_view(map.options), Contains("is no page with a map in it"));
}
