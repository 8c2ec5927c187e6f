// Tests of the HTML report of a merge.
#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "src/apps/picture/image.hpp"
#include "src/apps/picture/raster.hpp"
#include "src/apps/report/format.hpp"
#include "src/apps/report/pair_quality.hpp"
#include "src/apps/report/summary.hpp"
#include "src/apps/report/times.hpp"
#include "src/apps/report/waiting_pairs.hpp"
#include "tests/evaluate/synthetic_merge.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

/// Writes the report of a synthetic merge.
void write(const std::filesystem::path& path, const ReportInput& input) {
  write_report(path, input, map_files(input.title, *input.sessions, *input.result, 0.2F));
}

/// A synthetic merge and its report.
struct Reported {
  TemporaryDirectory folder;
  synthetic::Merge merge;

  explicit Reported(float step_m) { synthetic::fill(merge, step_m); }
  [[nodiscard]] std::string page() const {
    write(folder / "report.html", merge.input);
    return datasets::read_file(folder / "report.html");
  }
};

/// The page without what base64 may spell by chance.
std::string without_pictures(std::string page) {
  for (auto at = page.find("base64,"); at != std::string::npos; at = page.find("base64,", at + 1)) {
    page.erase(at + 7, page.find('"', at) - at - 7);
  }
  return page;
}

}  // namespace

TEST_CASE("a report is one page that needs no network") {
  Reported reported(1.0F);
  reported.folder.write("stats.json",
                        R"({"arena_bytes":1,"stage_ms":{"removal":{"p50":4.25,"p99":7,"max":9},
      "total":{"p50":8,"p99":11.5,"max":12}},
      "total_histogram":{"upper_edge_ms":[5,10,20],"keyframes":[3,80,4,0]}})");
  reported.merge.input.references[0].run = reported.folder.path();
  const std::string page = reported.page();
  const std::string text = without_pictures(page);
  CHECK(count(text, " src=\"") == 0);
  CHECK(count(text, "<link") == 1);  // an icon that is none
  CHECK(count(text, "rel=\"icon\" href=\"data:,\"") == 1);
  CHECK_THAT(text, Contains("default-src 'none'"));
  CHECK_THAT(text, Contains("id=\"map-json\"") && Contains("id=\"points/static/r\""));
  CHECK(count(page, "data:image/svg+xml") == 1);
  CHECK_THAT(page, Contains("A little town &lt;three&gt; times"));
  CHECK_THAT(page, Contains("3 of 4 sessions share one frame, 1 unconnected"));
  CHECK_THAT(page, Contains("wednesday") && Contains("livox-avia"));
  CHECK_THAT(page, Contains("2 loops found, 3 that agree are needed"));
  CHECK_THAT(page, Contains("outside the consistency set of its two sessions"));
  CHECK_THAT(page, Contains(">98.12<"));  // SA
  // DA of what moved while it was seen; whatever has a dynamic label stands beside it.
  CHECK_THAT(page, Contains(">97.50<") && Contains(">91.36</span>"));
  CHECK_THAT(page, Contains(">4.25<"));  // p50 of the removal stage
  CHECK(count(text.substr(text.find("<template id=\"report\">")), "nan") == 0);
}

TEST_CASE("a provisional pair names its placement, two keyframes and what decides it") {
  Reported reported(1.0F);
  synthetic::Merge& merge = reported.merge;
  const char* reason = "ambiguous: 13 loops contradict 37";
  merge::MergeResult& result = merge.result;
  result.sessions[3].status = merge::SessionStatus::kProvisional;
  result.sessions[3].reason = reason;
  merge::PairOutcome pair{0, 3, merge::PairState::kProvisional, reason, 50, 37, 13, {}};
  pair.T_match_session_query_session = Pose(Eigen::Matrix3d::Identity(), {5.0, 2.0, 0.0});
  result.pairs.push_back(pair);
  // The second loop says what the pair says; that of a search the other way round is off by 9 m.
  const auto pose = [&](std::size_t s, std::size_t k) {
    return result.sessions[s].T_map_keyframe[k];
  };
  for (const double off_m : {9.0, 0.0}) {
    merge::LoopConstraint& loop = result.loops.emplace_back();
    loop.match = {0, 30};
    loop.query = {3, 10};
    loop.T_match_query = pose(0, 30).inverse() * pair.T_match_session_query_session * pose(3, 10);
    loop.T_match_query.translation.x() += off_m;
    loop.decision.reason = reason;
    if (off_m == 0.0) continue;
    std::swap(loop.match, loop.query);
    loop.T_match_query = loop.T_match_query.inverse();
    loop.query.keyframe = 31;
  }
  const std::vector<WaitingPair> waiting = waiting_pairs(merge.sessions, result);
  REQUIRE(waiting.size() == 1);
  CHECK(waiting[0].query_keyframe == "elsewhere:10");
  CHECK(waiting[0].match_keyframe == "monday:30");
  CHECK_THAT(waiting[0].sentence, Contains("monday and elsewhere wait: " + std::string(reason)));
  CHECK_THAT(waiting[0].sentence, Contains("37 loops place elsewhere:10"));
  CHECK_THAT(waiting[0].sentence,
             Contains("farther along the way of monday may decide: from monday:30 towards "));
  CHECK_THAT(waiting_text(merge.sessions, result, "site"),
             Contains("unimapper map link --store site elsewhere:10 monday:30") &&
                 Contains("unimapper map apart --store site elsewhere"));
  CHECK(waiting[0].other_query_keyframe.empty());  // a single loop is no placement
  CHECK_THAT(reported.page(),
             Contains("unimapper map forbid --store STORE elsewhere:10 monday:30"));

  // Two loops agree on another one.
  merge::LoopConstraint another = result.loops.back();
  another.query.keyframe = 12;
  another.T_match_query = pose(0, 30).inverse() * pair.T_match_session_query_session * pose(3, 12);
  another.T_match_query.translation.x() += 9.5;
  result.loops.push_back(another);
  CHECK_THAT(waiting_pairs(merge.sessions, result)[0].sentence,
             Contains("Others place elsewhere:") && Contains("m from there."));
  CHECK_THAT(waiting_text(merge.sessions, result, "site"), Contains("# or these are"));

  result.pairs.back().state = merge::PairState::kConfirmed;
  CHECK(waiting_pairs(merge.sessions, result).empty());
}

TEST_CASE("the agreement of two sessions stands in report, terminal and quality.json") {
  Reported reported(1.0F);
  synthetic::Merge& merge = reported.merge;
  const auto written = [&](const std::vector<PairQuality>& qualities) {
    const auto file = reported.folder / "quality.json";
    write_pair_qualities(file, merge.sessions, qualities);
    return nlohmann::json::parse(datasets::read_file(file))["pairs"][0];
  };
  // Their sessions hold no cells: nothing can be compared, and that is what is said.
  const std::vector<PairQuality> none = pair_qualities(merge.sessions, merge.result, {});
  REQUIRE(none.size() == 2);  // both with the central session; refused loops connect none
  CHECK(written(none)["walls_median_m"].is_null());

  PairQuality pair = none.front();
  pair.merged.walls = {0.042, 0.1, 900};
  pair.at_truth.emplace().walls = {0.031, 0.08, 901};
  merge.input.qualities = {pair};
  const nlohmann::json json = written(merge.input.qualities);
  CHECK(json["walls_median_m"] == 0.042);
  CHECK(json["at_truth"]["wall_points"] == 901);
  CHECK_THAT(summary_table(merge.input),
             Contains("monday and wednesday: walls 0.042 m apart (median), 0.031 m at the truth"));
  CHECK_THAT(quality_section(merge.sessions, merge.input.qualities),
             Contains("monday and wednesday") && Contains("at the truth"));
  CHECK(quality_section(merge.sessions, {}).empty());

  CHECK(walls_apart_text(merge.sessions, merge.input.qualities).empty());
  merge.input.qualities[0].merged.walls.p90_m = 0.29;
  CHECK_THAT(walls_apart_text(merge.sessions, merge.input.qualities),
             Contains("the walls of monday and wednesday lie up to 0.29 m apart"));
  CHECK_THAT(quality_section(merge.sessions, merge.input.qualities), Contains("look alike"));
  CHECK(written(merge.input.qualities)["walls_apart"] == true);
  // Too few points to say so.
  merge.input.qualities[0].merged.walls.points = 100;
  CHECK(walls_apart_text(merge.sessions, merge.input.qualities).empty());
}

TEST_CASE("equal results give equal reports") {
  CHECK((Reported(2.0F).page() == Reported(2.0F).page()));
}

TEST_CASE("a report of next to nothing is still a report") {
  TemporaryDirectory folder;
  std::vector<SessionData> sessions(1);
  sessions[0].info.name.assign(1, 'x');
  merge::MergeResult result;
  result.sessions.resize(1);
  ReportInput input;
  input.sessions = &sessions;
  input.result = &result;
  const auto file = folder / "r.html";
  write(file, input);
  CHECK_THAT(datasets::read_file(file), Contains("1 session, none merged"));
  CHECK_THAT(summary_table(input), Contains("0 of 1 sessions in one frame"));

  sessions.clear();
  result.sessions.clear();
  write(file, input);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  result.map.push_back({{nan, 0, 0}, 7, 1});
  result.map.push_back({{1e30F, -1e30F, 0}, 7, 1});
  write(file, input);
}

TEST_CASE("a report that cannot be written says so") {
  synthetic::Merge merge;
  synthetic::fill(merge, 4.0F);
  CHECK_THROWS_WITH(write("/nonexistent/report.html", merge.input),
                    Contains("/nonexistent/report.html: cannot be written"));
}

TEST_CASE("the summary's errors come from one alignment of the central session") {
  synthetic::Merge merge;
  synthetic::fill(merge, 4.0F);
  // Another world for the truth: nothing may change.
  const Pose T_world_map = synthetic::heading(500, -200, 2.0);
  for (auto& reference : merge.input.references) {
    for (auto& pose : reference.truth) pose.T_world_sensor = T_world_map * pose.T_world_sensor;
  }
  for (Pose& pose : merge.result.sessions[2].T_map_keyframe) pose.translation.z() += 3.0;
  const char* ambiguous = "ambiguous: 13 loops contradict 37";
  merge.result.loops.emplace_back().decision.reason = ambiguous;
  const Summary summary = summarize(merge.input);
  REQUIRE(summary.has_truth);
  CHECK(summary.sessions[0].error->translation_m.rmse < 0.2);
  CHECK(summary.sessions[2].error->translation_m.median == Approx(3.0).margin(0.1));
  CHECK_FALSE(summary.sessions[3].error.has_value());
  CHECK(summary.inter.accepted == 60);
  CHECK(summary.inter.refused == 30);
  CHECK(summary.intra.accepted == 18);
  // Figures are left out of the reasons of single loops alone.
  CHECK(summary.refusals.at("overlap (limit 0.45)") == 22);
  CHECK(summary.refusals.at(ambiguous) == 1);
  CHECK(summary.loops_by_pair.at({0, 2}).accepted == 30);
  CHECK(summary.merged_sessions == 3);
}

TEST_CASE("the summary table lines its columns up") {
  synthetic::Merge merge;
  synthetic::fill(merge, 4.0F);
  const std::string table = summary_table(merge.input);
  const std::size_t second_line = table.find('\n', 1) + 1;  // an empty one comes first
  const std::string head = table.substr(1, second_line - 2);
  const std::string first = table.substr(second_line, table.find('\n', second_line) - second_line);
  CHECK(head.find("status") == first.find("central"));
  CHECK(head.find("SA %") + 4 == first.find("98.12") + 5);
  CHECK_THAT(table, Contains("elsewhere is not connected: 2 loops found"));
  CHECK_THAT(table, Contains("60 inter-session and 18 intra-session accepted, 30 refused"));
}

TEST_CASE("the summary names the sessions with keyframes that do not know up") {
  synthetic::Merge merge;
  synthetic::fill(merge, 4.0F);
  for (auto& keyframe : merge.sessions[0].keyframes) keyframe.up = {true, 1e-5F, 0.0F, 1e-5F};
  merge.sessions[1].keyframes[0].up = {true, 1e-5F, 0.0F, 1e-5F};
  const std::string table = summary_table(merge.input);
  const std::size_t keyframes = merge.sessions[1].keyframes.size();
  CHECK_THAT(table, !Contains(merge.sessions[0].info.name + ": up is unknown"));
  CHECK_THAT(table, Contains(merge.sessions[1].info.name + ": up is unknown in " +
                             std::to_string(keyframes - 1) + " of " + std::to_string(keyframes) +
                             " keyframes"));
}

TEST_CASE("times name the load under which they were taken") {
  Reported reported(2.0F);
  synthetic::Merge& merge = reported.merge;
  const TemporaryDirectory& folder = reported.folder;
  linux_port::HostLoad host{"Some <processor>", 4, 2, 1.25};
  merge.input.load = load_between(host, {"", 0, 3, -1.0});
  const std::string said =
      "Some <processor>, 4 cores; 3 processes of unimapper; load average 1.25 at the start, "
      "unknown at the end";
  CHECK(load_text(*merge.input.load) == said);
  const std::string stats = R"({"stage_ms":{"total":{"p50":8,"p99":11.5,"max":12}}, "load":)";
  folder.write("stats.json", stats + load_json({"Small board", 1, 1, 0.5, 0.75}).dump() + "}");
  merge.input.references[1].run = folder.path();
  CHECK_THAT(reported.page(), Contains("Some &lt;processor&gt;, 4 cores; 3 processes") &&
                                  Contains(">11.5<") &&
                                  Contains("Small board, 1 core; 1 process of"));

  MapFiles files = map_files("town", merge.sessions, merge.result, 0.2F);
  add_times(files, merge.input);
  write_map_files(folder.path(), files);
  const auto json = nlohmann::json::parse(*FolderView(folder.path()).map_json(0));
  CHECK(json["timing"]["load"] == said);
  CHECK(json["timing"]["stages"].size() == 4);
  REQUIRE(json["online"].size() == 1);
  CHECK(json["online"][0]["session"] == 1);
  CHECK(json["online"][0]["p99_ms"] == 11.5);
  CHECK(json["online"][0]["load"] == load_text({"Small board", 1, 1, 0.5, 0.75}));

  folder.write("times.json", "[1");
  CHECK_THROWS_WITH(FolderView(folder.path()), Contains("times.json: holds no times"));

  // Of an earlier version, or damaged.
  for (const char* rest : {R"("nothing"})", R"({"cores": "many"}})"}) {
    folder.write("stats.json", stats + rest);
    merge.input.load.reset();
    CHECK(count(reported.page(), kLoadUnknown) >= 2);
  }
}

TEST_CASE("statistics that are none are left out") {
  TemporaryDirectory folder;
  CHECK_FALSE(read_run_stats({}).has_value());
  CHECK_FALSE(read_run_stats(folder.path()).has_value());
  folder.write("stats.json", R"({"stage_ms": 3})");
  CHECK_FALSE(read_run_stats(folder.path()).has_value());
  folder.write("stats.json",
               R"({"stage_ms":{},"total_histogram":{"upper_edge_ms":[1,2],"keyframes":[1]}})");
  REQUIRE(read_run_stats(folder.path()).has_value());
  CHECK(read_run_stats(folder.path())->histogram_counts.empty());
}

TEST_CASE("base64 pads as it must") {
  const auto encode = [](const std::string& text) {
    return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  CHECK(encode("") == "");
  CHECK(encode("f") == "Zg==");
  CHECK(encode("fo") == "Zm8=");
  CHECK(encode("foo") == "Zm9v");
  CHECK(encode("foobar") == "Zm9vYmFy");
}

TEST_CASE("a point covers the pixels its voxel covers, no more and no less") {
  Frame frame;
  frame.min_x = 0;
  frame.max_y = 10;
  frame.metres_per_pixel = 1;
  frame.width = 10;
  frame.height = 10;
  std::size_t pixels = 0;
  const auto covered = [&](double x, double y, double size) {
    double sum = 0.0;
    pixels = 0;
    for_covered_pixels(frame, x, y, size, [&](std::size_t, float share) {
      sum += static_cast<double>(share);
      ++pixels;
    });
    return sum;
  };
  CHECK(covered(5.0, 5.0, 2.0) == Approx(4.0));
  CHECK(pixels == 4);
  CHECK(covered(5.25, 5.5, 0.1) == Approx(1.0));  // never thinner than a pixel
  CHECK(covered(0.0, 10.0, 2.0) == Approx(1.0));  // a corner of the picture
  CHECK(covered(500.0, 5.0, 2.0) == 0.0);
  CHECK(covered(std::nan(""), 5.0, 2.0) == 0.0);
}

TEST_CASE("the picture follows the paths, not far-away returns") {
  Extent extent;
  for (int i = 0; i < 100; ++i) extent.add_scenery(i % 2 == 0 ? 5000.0 : -20.0, i);
  for (int i = 0; i < 100; ++i) extent.add_path(i, 50.0);
  const Frame frame = extent.fit(1000, 0.05);
  CHECK(frame.min_x < -20.0);
  CHECK(frame.min_x + frame.metres_per_pixel * static_cast<double>(frame.width) < 250.0);
  CHECK(std::max(frame.width, frame.height) == 1000);
}

TEST_CASE("numbers read as people write them") {
  CHECK(grouped(1234567) == "1\u202f234\u202f567");
  CHECK(grouped(12) == "12");
  CHECK(short_count(9999) == "9\u202f999");
  CHECK(short_count(373597) == "374\u00a0k");
  CHECK(short_count(2580033) == "2.58\u00a0M");
  CHECK(length(0.0821) == "0.082\u00a0m");
  CHECK(length(1250.0) == "1.25\u00a0km");
  CHECK(fixed(std::nan(""), 2) == "\u2013");
  CHECK(escaped("<a href=\"x\">&") == "&lt;a href=&quot;x&quot;&gt;&amp;");
}
