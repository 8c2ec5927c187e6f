// Tests of a map as files of the page.
#include "src/apps/view/map_files.hpp"

#include <nlohmann/json.hpp>

#include "tests/evaluate/synthetic_merge.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/view/gunzip.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

MapFiles files_of_synthetic_merge(float spacing_m = 2.0F) {
  synthetic::Merge merge;
  synthetic::fill(merge, spacing_m);
  merge.sessions[0].info.name = "</script><b>";
  return map_files("town", merge.sessions, merge.result, 0.2F);
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("files of a map name sessions, loops, pairs and layers, with a block for each node") {
  const MapFiles files = files_of_synthetic_merge();
  const Json json = Json::parse(files.json);
  CHECK(json["format"] == 1);
  CHECK(json["sessions"].size() == 4);
  CHECK(json["sessions"][3]["status"] == "unconnected");
  CHECK(json["loops"].size() > 100);
  for (const Json& session : json["sessions"]) {
    CHECK(session["poses"].size() == session["stamps_s"].size());
    CHECK(session["poses"].size() == session["sequences"].size());
  }
  std::size_t points = 0;
  for (const auto& node : json["layers"]["static"]["nodes"]) {
    const auto block = files.blocks.read("static/" + node[0].get<std::string>());
    REQUIRE(block);
    CHECK(block->size() == node[2]);
    points += test::number_at<std::uint32_t>(test::gunzip(*block), 8);
  }
  synthetic::Merge merge;
  synthetic::fill(merge, 2.0F);
  CHECK(points == merge.result.map.size());
}

TEST_CASE("equal maps give equal files, and other maps have another version") {
  const MapFiles a = files_of_synthetic_merge();
  const MapFiles b = files_of_synthetic_merge();
  CHECK(a.json == b.json);
  REQUIRE(a.blocks.sizes() == b.blocks.sizes());
  for (const auto& [name, bytes] : a.blocks.sizes()) {
    CHECK(a.blocks.read(name) == b.blocks.read(name));
  }
  const Json other = Json::parse(files_of_synthetic_merge(2.5F).json);
  CHECK(Json::parse(a.json)["version"] != other["version"]);
}

TEST_CASE("the page with a map holds it within its limit, and no text of it becomes script") {
  const MapFiles files = files_of_synthetic_merge();
  const std::string whole = page_with(files, 100'000'000, {"<p>report</p>", ""});
  CHECK(count(whole, "<script") == count(empty_page(), "<script") + files.blocks.size() + 1);
  CHECK(count(whole, "</script><b>") == 0);
  CHECK_THAT(whole, Contains("<template id=\"report\"><p>report</p></template>"));
  const std::string part = page_with(files, 5'000);
  CHECK(part.size() < empty_page().size() + files.json.size() + 10'000);
  CHECK_THAT(part, Contains("\"points_left_out\""));
  CHECK_THAT(part, !Contains("\"points_left_out\":0"));
}

TEST_CASE("a folder with a map is shown as it was written") {
  TemporaryDirectory folder;
  const MapFiles files = files_of_synthetic_merge();
  write_map_files(folder.path() / "view", files);
  FolderView view(folder.path() / "view");
  CHECK(*view.map_json(0) == files.json);
  CHECK(view.block("0", "static", "r") == files.blocks.read("static/r"));
  CHECK_FALSE(view.block("0", "static", "r000000"));
  CHECK(view.decide({"a:0", "b:0"}, LoopStatement::kWrong, 0).status == 403);
  CHECK_THROWS_WITH(FolderView(folder.path()), Contains("holds no map.json"));
}
