// Tests of the evaluations on valid and damaged folders.
#include <nlohmann/json.hpp>

#include "ports/datasets/writers.hpp"
#include "ports/lcm/session_log.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/ply_cloud.hpp"
#include "src/apps/session_clouds.hpp"
#include "src/merge/export/loops_csv.hpp"
#include "tests/evaluate/small_folders.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

using namespace unimapper::test;

namespace fs = std::filesystem;

namespace {

/// A run folder with one keyframe every ten scans and the given rows of loops.csv.
void write_run(const fs::path& run, const std::string& session, std::uint32_t keyframes,
               const std::string& rows) {
  fs::create_directories(run);
  lcm_port::SessionLogWriter log(run / "keyframes.lcmlog", {{1, 1}, session, "os2-128"});
  for (std::uint32_t k = 0; k < keyframes; ++k) {
    KeyframeRecord record;
    record.session = {1, 1};
    record.sequence = k;
    record.scans = {{k * 10, static_cast<std::int64_t>(k) * 1'000'000'000, at(0)}};
    log.write(wire::wire_test::encode_for_sending(record));
  }
  log.finish();
  write_lines(run / "loops.csv", kLoopsHeader + rows);
}

EvaluateLoopsOptions loops_options(const fs::path& run, const fs::path& truth) {
  EvaluateLoopsOptions options;
  options.run = run;
  options.truth = truth;
  return options;
}

/// Truth of a robot that goes 100 m per keyframe and comes back over the same positions.
std::vector<Pose> there_and_back(std::size_t keyframes) {
  std::vector<Pose> truth;
  for (std::size_t k = 0; k < keyframes; ++k) {
    const double step = static_cast<double>(k < keyframes / 2 ? k : keyframes - 1 - k);
    truth.insert(truth.end(), 10, at(100.0 * step, k < keyframes / 2 ? 0.0 : 1.0));
  }
  return truth;
}

}  // namespace

TEST_CASE("evaluate dynamic reports both protocols in percent") {
  TemporaryDirectory folder;
  const EvaluateDynamicOptions options{folder / "d", folder / "r"};
  write_dataset(
      options.truth, {at(0), at(1)},
      {{10, 0, 0, 0}, {10.02F, 0, 0, 0}, {20, 0, 0, 0}, {30, 0, 0, 0}, {60, 0, 0, 0}, {5, 0, 0, 0}},
      {50, 50, 254, 252, 50, 0});
  write_run_labels(options.run, 2, {9, 251, 251, 9, 9, 251});
  const Json json = Json::parse(evaluate_dynamic(options));
  CHECK(json["SA"].get<double>() == Approx(100.0 * 2 / 3));
  CHECK(json["DA"].get<double>() == Approx(50.0));
  CHECK(json["AA"].get<double>() == Approx(100.0 * std::sqrt(1.0 / 3)));
  CHECK(json["ignored_points"] == 2);
  CHECK(json["by_class"]["pedestrian"]["DA"] == 100.0);
  CHECK(json["by_class"]["car"]["DA"] == 0.0);
  CHECK(json["by_class"]["car"]["SA"].is_null());
  CHECK(json["by_range_m"]["50-80"]["static_points"] == 2);
  CHECK(json["benchmark"]["SA"] == 100.0);  // 2 cm from a kept point, and nothing beyond 50 m
  CHECK(json["benchmark"]["static_points"] == 4);
  CHECK(json["benchmark"]["DA"] == 50.0);
  CHECK(json["scans"] == 2);
}

TEST_CASE("evaluate dynamic reports what began to move where the recording says when") {
  TemporaryDirectory folder;
  const EvaluateDynamicOptions options{folder / "d", folder / "r"};
  write_dataset(options.truth, {at(0), at(1)}, {{10, 0, 0, 0}, {20, 0, 0, 0}},
                {254U | (5U << 16U), 50});
  write_run_labels(options.run, 2, {251, 9});
  CHECK(Json::parse(evaluate_dynamic(options))["since_motion"].is_null());
  folder.write("d/motion.txt", "5 1 1\n");
  const Json since = Json::parse(evaluate_dynamic(options))["since_motion"];
  CHECK(since["dynamic_points"] == 1);
  CHECK(since["DA"] == 100.0);
  CHECK(since["moving"]["dynamic_points"] == 1);
  CHECK(since["before"]["dynamic_points"] == 1);
  folder.write("d/motion.txt", "5 1 1\n5 4\n");
  CHECK_THROWS_WITH(evaluate_dynamic(options), Contains("line 2"));
}

TEST_CASE("evaluate dynamic says which labels are missing or too short, of the scans asked for") {
  TemporaryDirectory folder;
  EvaluateDynamicOptions options{folder / "d", folder / "r"};
  const std::vector<datasets::Scan::Point> points = {{10, 0, 0, 0}, {11, 0, 0, 0}};
  write_dataset(options.truth, {at(0), at(1)}, points, {50, 50});
  CHECK_THROWS_WITH(evaluate_dynamic(options), Contains("labels: no such folder"));
  write_run_labels(options.run, 1, {9, 9});
  CHECK_THROWS_WITH(evaluate_dynamic(options), Contains("000001.label: no such file"));
  options.scans = 1;
  const Json json = Json::parse(evaluate_dynamic(options));
  CHECK(json["scans"] == 1);
  CHECK(json["static_points"] == 2);
  write_run_labels(options.run, 2, {9});
  CHECK_THROWS_WITH(evaluate_dynamic(options),
                    Contains("000000.label: 4 bytes, but the scan has 2 points"));
  write_dataset(folder / "unlabelled", {at(0)}, points);
  write_run_labels(options.run, 1, {9, 9});
  CHECK_THROWS_WITH(evaluate_dynamic({folder / "unlabelled", options.run}),
                    Contains("no ground-truth labels"));
  CHECK_THROWS_WITH(evaluate_dynamic({folder / "nowhere", options.run}), Contains("nowhere"));
}

TEST_CASE("evaluate loops scores intra-session revisits with the keyframes' true poses") {
  TemporaryDirectory folder;
  write_dataset(folder / "d", there_and_back(6), {{10, 0, 0, 0}});
  // Keyframe 5 is back at 0, 4 at 1, 3 at 2 (too soon for the gap of two).
  write_run(folder / "r", "a", 6,
            "a,5,50,a,0,0,0.9,1,descriptor,0,1,0,0,0,0,1\n"
            "a,4,40,a,2,20,0.5,0,too little overlap,0,0,0,0,0,0,1\n"
            "a,4,40,other,1,10,0.9,1,descriptor,0,0,0,0,0,0,1\n");
  EvaluateLoopsOptions options = loops_options(folder / "r", folder / "d");
  options.min_gap_keyframes = 2;
  options.curve = true;
  const Json json = Json::parse(evaluate_loops(options));
  CHECK(json["queries"] == 6);
  CHECK(json["positives"] == 2);
  CHECK(json["loops"] == 2);
  CHECK(json["precision"] == 1.0);
  CHECK(json["recall"] == 0.5);
  CHECK(json["precision_pose"] == 1.0);
  CHECK(json["recall_at_full_precision"] == 0.5);
  CHECK(json["median_translation_error_m"].get<double>() == Approx(0.0).margin(1e-9));
  CHECK(json["curve"].size() == 2);
}

TEST_CASE("evaluate loops against another run scores inter-session loops") {
  TemporaryDirectory folder;
  write_dataset(folder / "da", there_and_back(6), {{10, 0, 0, 0}});
  write_dataset(folder / "db", std::vector<Pose>(10, at(103)), {{10, 0, 0, 0}});
  write_run(folder / "a", "a", 6, "");
  write_run(folder / "b", "b", 1,
            "b,0,0,a,1,10,0.9,1,descriptor,3,0,0,0,0,0,1\n"
            "b,0,0,b,0,0,0.9,1,descriptor,0,0,0,0,0,0,1\n");
  EvaluateLoopsOptions options = loops_options(folder / "b", folder / "db");
  options.against = folder / "a";
  options.against_truth = folder / "da";
  const Json json = Json::parse(evaluate_loops(options));
  CHECK(json["recall"] == 1.0);
  CHECK(json["recall_pose"] == 1.0);
  CHECK(json["loops"] == 1);
  options.against = options.run;
  CHECK_THROWS_WITH(evaluate_loops(options), Contains("both runs are of session \"b\""));
}

TEST_CASE("evaluate loops refuses a run of another dataset, and damaged tables") {
  TemporaryDirectory folder;
  write_dataset(folder / "d", {at(0), at(1)}, {{10, 0, 0, 0}});
  write_run(folder / "r", "a", 6, "");
  CHECK_THROWS_WITH(evaluate_loops(loops_options(folder / "r", folder / "d")),
                    Contains("do not belong together"));

  const fs::path csv = folder / "loops.csv";
  CHECK_THROWS_WITH(merge::read_loops_csv(csv), Contains("no such file"));
  const std::pair<std::string, const char*> damaged[] = {
      {"", "loops.csv:1: is empty"},
      {"query_session,query_keyframe\n", "has no column \"query_scan\""},
      {kLoopsHeader + "a,1,2\n", "loops.csv:2: 3 fields"},
      {kLoopsHeader + "a,x,1,a,1,1,0.5,1,r,0,0,0,0,0,0,1\n",
       "\"x\" is no number for column query_keyframe"},
      {kLoopsHeader + "a,1,1,a,1,1,0.5,1,r,0,0,0,0,0,0,0\n", "not a rigid transform"}};
  for (const auto& [text, reason] : damaged) {
    write_lines(csv, text);
    CHECK_THROWS_WITH(merge::read_loops_csv(csv), Contains(reason));
  }
  write_lines(csv, kLoopsHeader + "a,1,1,a,1,1,0.5,1,\"wrong, and \"\"far\"\"\",0,0,0,0,0,0,1\r\n");
  REQUIRE(merge::read_loops_csv(csv).size() == 1);
  CHECK(merge::read_loops_csv(csv)[0].reason == "wrong, and \"far\"");
}

TEST_CASE("evaluate trajectory aligns the central session only") {
  TemporaryDirectory folder;
  write_dataset(folder / "d", circle(), {{10, 0, 0, 0}});
  const Pose T_map_truth{Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                         {50, 60, 70}};
  write_map(folder / "m", {{"a", "central"}, {"b", "merged"}, {"c", "unconnected"}}, circle(),
            T_map_truth, 0.3);
  EvaluateTrajectoryOptions options;
  options.map = folder / "m";
  for (const char* name : {"a", "b", "c"}) options.truths.emplace_back(name, folder / "d");
  const Json sessions = Json::parse(evaluate_trajectory(options))["sessions"];
  CHECK(sessions["a"]["ate_m"]["rmse"].get<double>() == Approx(0.0).margin(1e-6));
  CHECK(sessions["b"]["ate_m"]["rmse"].get<double>() == Approx(0.3));
  CHECK(sessions["b"]["ate_m"]["median"].get<double>() == Approx(0.3));
  CHECK(sessions["b"]["rotation_deg"]["max"].get<double>() == Approx(0.0).margin(1e-4));
  CHECK(sessions["b"]["tilt_deg"]["max"].get<double>() == Approx(0.0).margin(1e-4));
  CHECK(sessions["b"]["paired"] == 30);
  CHECK(sessions["c"]["status"] == "unconnected");
  CHECK(sessions["c"]["ate_m"].is_null());
  CHECK(sessions["c"]["tilt_deg"].is_null());

  options.truths = {{"b", folder / "d"}};
  CHECK_THROWS_WITH(evaluate_trajectory(options), Contains("central session"));
  options.truths = {{"nobody", folder / "d"}};
  CHECK_THROWS_WITH(evaluate_trajectory(options), Contains("no session \"nobody\"; it has: a, b"));
  options.map = folder / "nowhere";
  CHECK_THROWS_WITH(evaluate_trajectory(options), Contains("summary.json: no such file"));
}

namespace {

const std::string kCarAt10 = "10 10 0 0.7 0 4.5 1.8 1.4\n";

/// Two visits of twelve scans from one place: a car stands there on the first day, a wall behind it
/// is seen on the second. Returns the options, and writes the truth's trajectories as the map's.
EvaluateChangesOptions two_visits(const fs::path& folder) {
  std::vector<datasets::Scan::Point> car;
  std::vector<datasets::Scan::Point> wall;
  for (int i = 0; i < 10; ++i) {
    const float y = 0.1F * static_cast<float>(i) - 0.45F;
    car.push_back({7.8F, y, 0.7F, 0});
    wall.push_back({20.0F, 2.5F * y, 1.4F, 0});
  }
  std::vector<Pose> truth;
  for (int i = 0; i < 12; ++i) truth.push_back(at(0.1 * i, 0.3 * (i % 3)));
  write_dataset(folder / "a", truth, car, std::vector<std::uint32_t>(10, 10));
  write_dataset(folder / "b", truth, wall, std::vector<std::uint32_t>(10, 50));
  write_lines(folder / "a" / "objects.txt", "# header\n" + kCarAt10);
  write_lines(folder / "b" / "objects.txt", "# header\n");
  write_map(folder / "map", {{"a", "central"}, {"b", "merged"}}, truth);
  return {folder / "map", {"a", folder / "a"}, {"b", folder / "b"}};
}

/// changes.json with a car that is gone at each of these x.
void write_gone_cars(const fs::path& map, const std::vector<double>& x_m) {
  Json objects = Json::array();
  for (const double x : x_m) {
    objects.push_back(
        {{"kind", "gone"},
         {"session", "a"},
         {"free_in", "b"},
         {"box", {{"centre", {x, 0.0, 0.7}}, {"yaw", 0.0}, {"size", {4.4, 1.7, 1.3}}}}});
  }
  write_lines(map / "changes.json", Json{{"objects", objects}}.dump());
}

}  // namespace

TEST_CASE("evaluate changes finds the car that is gone, and what is wrong") {
  TemporaryDirectory folder;
  const EvaluateChangesOptions options = two_visits(folder.path());
  write_gone_cars(options.map, {10.1, 40.0});
  const Json json = Json::parse(evaluate_changes(options));
  CHECK(json["vehicles_changed"] == 1);
  CHECK(json["vehicles_found"] == 1);
  CHECK(json["recall"] == 100.0);
  CHECK(json["precision"] == 50.0);
  CHECK(json["found"] == 2);
  CHECK(json["right"] == 1);
  REQUIRE(json["wrong"].size() == 1);
  CHECK(json["wrong"][0]["box"]["centre"][0].get<double>() == Approx(40.0));
  CHECK(json["missed"].empty());

  write_gone_cars(options.map, {});
  const Json nothing = Json::parse(evaluate_changes(options));
  CHECK(nothing["recall"] == 0.0);
  CHECK(nothing["precision"].is_null());
  REQUIRE(nothing["missed"].size() == 1);
  CHECK(nothing["missed"][0]["label"] == 10);
}

TEST_CASE("evaluate changes counts what stood during one visit apart") {
  TemporaryDirectory folder;
  const EvaluateChangesOptions options = two_visits(folder.path());
  // The car that the scans show is traffic that waited: the scene does not list it.
  write_lines(folder / "a" / "objects.txt", "# header\n");
  write_gone_cars(options.map, {10.0});
  const Json json = Json::parse(evaluate_changes(options));
  CHECK(json["stood"] == 1);
  CHECK(json["wrong"].empty());
  CHECK(json["vehicles_changed"] == 0);
  CHECK(json["recall"].is_null());
}

TEST_CASE("evaluate changes leaves out what one of the visits could not see") {
  TemporaryDirectory folder;
  EvaluateChangesOptions options = two_visits(folder.path());
  write_gone_cars(options.map, {});
  options.reach_m = 5.0;
  CHECK(Json::parse(evaluate_changes(options))["vehicles_changed"] == 0);
  options.reach_m = 25.0;
  // On the second day something stands before its place.
  fs::copy(folder / "a" / "scans", folder / "b" / "scans",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  CHECK(Json::parse(evaluate_changes(options))["vehicles_changed"] == 0);
}

TEST_CASE("evaluate changes says which file is missing or damaged") {
  TemporaryDirectory folder;
  const EvaluateChangesOptions options = two_visits(folder.path());
  CHECK_THROWS_WITH(evaluate_changes(options), Contains("changes.json: cannot be read"));
  write_lines(options.map / "changes.json", R"({"objects": [{"kind": "gone"}]})");
  CHECK_THROWS_WITH(evaluate_changes(options), Contains("changes.json"));
  write_gone_cars(options.map, {10.0});
  write_lines(folder / "a" / "objects.txt", kCarAt10 + "10 1 2\n");
  CHECK_THROWS_WITH(evaluate_changes(options), Contains("objects.txt: line 2 is not an object"));
  write_lines(folder / "a" / "objects.txt", "10 x 0 0.7 0 4.5 1.8 1.4\n");
  CHECK_THROWS_WITH(evaluate_changes(options), Contains("objects.txt"));
}

TEST_CASE("a summary that is no summary is refused") {
  TemporaryDirectory folder;
  for (const char* text : {R"({"sessions": [{"name": 3}]})", R"({"sessions": [)"}) {
    folder.write("summary.json", text);
    CHECK_THROWS_WITH(evaluate_map({folder.path()}), Contains("summary.json"));
  }
}

TEST_CASE("evaluate map compares the sessions' own clouds") {
  TemporaryDirectory folder;
  SessionData session;
  session.keyframes.resize(1);
  for (int i = 0; i < 2500; ++i) {
    const auto row = static_cast<float>(i / 50);
    const auto column = static_cast<float>(i % 50);
    const auto step = static_cast<float>((i / 50 + i % 50) % 3);
    session.keyframes[0].static_cells.push_back(
        {{0.1F + 0.2F * row, 0.1F + 0.2F * column, 0.01F * step}, 1, 1, 0});
  }
  std::vector<SessionData> sessions(3, session);
  for (std::size_t s = 0; s < 3; ++s) sessions[s].info.name.assign(1, "abc"[s]);
  merge::MergeResult result;
  result.sessions.resize(3);
  for (merge::MergedSession& merged : result.sessions) merged.T_map_keyframe.resize(1);
  result.sessions[0].status = merge::SessionStatus::kCentral;
  result.sessions[1].status = merge::SessionStatus::kMerged;
  result.sessions[1].T_map_keyframe[0].translation.z() = 0.5;
  write_session_clouds(folder.path(), sessions, result);
  CHECK_FALSE(fs::exists(folder / "clouds" / "c.ply"));
  write_lines(folder / "summary.json",
              R"({"sessions":[{"name":"a","status":"central"},{"name":"b","status":"merged"},
                  {"name":"c","status":"unconnected"}]})");
  const Json json = Json::parse(evaluate_map({folder.path()}));
  REQUIRE(json["pairs"].size() == 1);
  CHECK(json["pairs"][0]["AC_mean_m"].get<double>() == Approx(0.5).margin(0.001));
  CHECK(json["pairs"][0]["CD_L2_m"].get<double>() == Approx(1.0).margin(0.002));
  CHECK(json["points"] == 5000);
  CHECK(json["MME_points"] == 5000);
}

TEST_CASE("damaged PLY files are refused with the reason") {
  TemporaryDirectory folder;
  const std::string format = "ply\nformat binary_little_endian 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\nend_header\n";
  const std::pair<std::string, const char*> damaged[] = {
      {"plz\n", "no PLY file"},
      {format + "element vertex 2\nproperty float x\n", "header has no end"},
      {"ply\nformat ascii 1.0\nend_header\n", "no element \"vertex\""},
      {format + "element vertex 2\nproperty float x\nproperty float y\nend_header\n",
       "no x, y and z"},
      {format + "element vertex 2\nproperty list uchar int x\nend_header\n", "of type 'list'"},
      {format + "element vertex 2\n" + xyz + "0123456789abcdef", "truncated"},
      {format + "element vertex 2\n" + xyz + "0123456789abcdef", "1 are there"},
      {format + "element vertex 99999999999\n" + xyz, "truncated"}};
  for (const auto& [text, reason] : damaged) {
    CHECK_THROWS_WITH(read_ply_positions(folder.write("a.ply", text)), Contains(reason));
  }
}
