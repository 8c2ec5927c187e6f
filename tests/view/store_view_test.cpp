// Tests of the map of a store as a page shows it while the store grows.
#include "src/apps/view/store_view.hpp"

#include <nlohmann/json.hpp>

#include "ports/store/project_writer.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const SessionInfo kZulu{{1, 11}, "zulu", "os2-128"};
const SessionInfo kAlpha{{2, 22}, "alpha", "vlp-16"};

store::LoopResult loop(const store::KeyframeRow& query, const store::KeyframeRow& match) {
  store::LoopResult result;
  result.query = query;
  result.match = match;
  result.information.setIdentity();
  result.accepted = true;
  result.reason = "a test";
  return result;
}

/// A base that hears zulu, then alpha, and a page of its store.
struct Site {
  TemporaryDirectory folder;
  store::store_test::Base base{folder.path()};
  std::optional<store::ProjectWriter> writer;
  std::optional<StoreView> view;

  void hear(const SessionInfo& info) {
    base.feed(wire::wire_test::session_stream(info, 3));
    base.advance();
  }
  void open(bool may_change = true) {
    StoreViewOptions options;
    options.store = folder.path();
    options.may_change = may_change;
    options.held = &base.store.lock();
    view.emplace(options);
  }
  /// Alpha's first keyframe where zulu's last is, and its last where zulu's first is.
  store::MapResult result(bool is_reversed) {
    store::MapResult result;
    result.parameters = "{}";
    const std::vector<Pose> poses(3);
    result.sessions.push_back({1, "central", "", {}, {0, 1, 2}, poses});
    result.sessions.push_back({2, "merged", "", {}, {0, 1, 2}, poses});
    result.loops = {loop({2, 0}, {1, 2}), loop({2, 2}, {1, 0})};
    if (is_reversed) std::swap(result.loops.front(), result.loops.back());
    return result;
  }
  /// As a base merges: at first an epoch, then that of the same number with another result.
  void merge(bool is_reversed) {
    if (!writer) writer.emplace(folder.path(), base.store.lock());
    const auto change = [&](store::ProjectState& state) {
      state.epoch.result = writer->keep(result(is_reversed));
      return std::optional<std::string>("merged");
    };
    REQUIRE((is_reversed ? writer->replace(1, change) : writer->commit("base --merge", change)));
  }
  [[nodiscard]] Json map() { return Json::parse(*view->map_json(0)); }
  /// The map once it is so: the page looks five times a second.
  template <typename Is>
  Json map_when(const Is& is) {
    Json shown = map();
    for (int look = 0; look < 500 && !is(shown); ++look) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      shown = map();
    }
    REQUIRE(is(shown));
    return shown;
  }
  /// The map of both sessions, merged.
  Json merged() {
    hear(kZulu);
    hear(kAlpha);
    open();
    merge(false);
    return map_when([](const Json& shown) { return shown["loops"].size() == 2; });
  }
  [[nodiscard]] std::vector<store::StoredStatement> statements() const {
    store::StoreReader reader(folder.path());
    CHECK(reader.check().empty());
    return reader.project().current().statements;
  }
};

bool has_two_sessions(const Json& map) { return map["sessions"].size() == 2; }
bool has_loops(const Json& map) { return map["loops"].size() == 2; }
bool is_reversed(const Json& map) { return has_loops(map) && map["loops"][0]["query"][1] == 2; }

}  // namespace

TEST_CASE("what a base that does not merge has heard is shown") {
  Site site;
  site.open();
  CHECK_THAT(site.map()["notice"].get<std::string>(), Contains("No keyframe is stored yet"));
  site.hear(kZulu);
  const Json shown = site.map_when([](const Json& map) { return map["sessions"].size() == 1; });
  CHECK(shown["epoch"] == 0);
  CHECK(shown["notice"].is_null());
  CHECK(shown["sessions"][0]["poses"].size() == 3);
  CHECK(site.view->keyframe(shown["version"], 0, 2).has_value());
}

TEST_CASE("a session that is heard later changes no other's number") {
  Site site;
  site.hear(kZulu);
  site.open();
  CHECK(site.map()["sessions"][0]["name"] == "zulu");
  site.hear(kAlpha);
  const Json grown = site.map_when(has_two_sessions);
  CHECK(grown["sessions"][0]["name"] == "zulu");
  CHECK(grown["sessions"][1]["name"] == "alpha");
  site.merge(false);
  const Json merged = site.map_when(has_loops);
  CHECK(merged["sessions"][1]["name"] == "alpha");
  CHECK(merged["loops"][0]["query"] == Json::array({1, 0}));
  // A page that has not heard of the new epoch yet asks as before.
  CHECK(site.view->keyframe(grown["version"], 1, 2) ==
        site.view->keyframe(merged["version"], 1, 2));
  CHECK_FALSE(site.view->keyframe("7.1.1", 1, 2).has_value());
  // An epoch that was, read anew.
  const Json earlier = Json::parse(*site.view->map_json(merged["epoch"]));
  CHECK(earlier["sessions"] == merged["sessions"]);
}

TEST_CASE("what is said of a loop is said of its keyframes, whatever its index has become") {
  Site site;
  const Json before = site.merged();
  site.merge(true);
  const Json now = site.map_when(is_reversed);
  CHECK(now["epoch"] == before["epoch"]);
  const NamedLoop first{"alpha:0", "zulu:2"};
  const ViewAnswer answer = site.view->decide(first, LoopStatement::kWrong, 1);
  INFO(answer.message);
  REQUIRE(answer.status == 200);
  const auto said = site.statements();
  REQUIRE(said.size() == 1);
  CHECK(said[0].kind == store::StatementKind::kForbidden);
  CHECK(said[0].query == store::KeyframeRow{2, 0});
  CHECK(said[0].match == store::KeyframeRow{1, 2});

  const std::int64_t epoch = Json::parse(answer.message)["epoch"];
  // The merge proposes no loop of these keyframes: what was said stays in sight.
  const Json refused = site.map_when([&](const Json& map) { return map["epoch"] == epoch; });
  REQUIRE(refused["loops"].size() == 1);
  CHECK(refused["loops"][0]["statement"] == "wrong");
  CHECK(refused["loops"][0]["query"] == now["loops"][1]["query"]);
  CHECK(refused["loops"][0]["T_match_query"].is_null());
  const ViewAnswer withdrawn =
      site.view->decide({"zulu:2", "alpha:0"}, LoopStatement::kNotYet, epoch);
  CHECK(withdrawn.status == 200);
  CHECK(site.statements().empty());
  CHECK(site.view->undo(Json::parse(withdrawn.message)["epoch"]).status == 200);
  CHECK(site.statements().size() == 1);
  CHECK(site.view->undo(epoch).status == 409);
  CHECK(site.view->undo(epoch + 2).status == 200);
  CHECK(site.statements().empty());
}

TEST_CASE("a loop that is not shown, or of another epoch, is not decided on") {
  Site site;
  (void)site.merged();
  const NamedLoop first{"alpha:0", "zulu:2"};
  CHECK(site.view->decide(first, LoopStatement::kWrong, 2).status == 409);
  for (const NamedLoop& other :
       {NamedLoop{"alpha:1", "zulu:2"}, NamedLoop{"", ""}, NamedLoop{"alpha:0", "zulu:02"}}) {
    const ViewAnswer answer = site.view->decide(other, LoopStatement::kWrong, 1);
    CHECK(answer.status == 409);
    CHECK_THAT(answer.message, Contains("no such loop in epoch 1"));
  }
  CHECK(site.statements().empty());
  site.view.reset();
  site.open(false);
  CHECK(site.view->decide(first, LoopStatement::kWrong, 1).status == 403);
  CHECK_FALSE(site.map()["can_change"].get<bool>());
}
