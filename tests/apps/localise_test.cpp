// End-to-end tests of `unimapper localise`: answers, and mistakes that are told in words.
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

TEST_CASE("a short run is answered keyframe by keyframe, and the store is left as it is") {
  const Project project;
  project.done({"add", project.run("monday", 34)});
  const std::string tuesday = project.run("tuesday", 12);
  const Words localise = {"localise", tuesday, "--store", project.store};
  check_fails(run_unimapper(localise), "`unimapper map merge` makes one");
  project.done({"merge"});
  const fs::path poses = project.directory / "tuesday.tum";
  const nlohmann::json answers =
      nlohmann::json::parse(run_well(localise, {"--json", "--out", poses}).out);
  CHECK(answers["epoch"] == 2);
  CHECK(answers["first_localised_m"].is_null());
  CHECK(answers["times_lost"] == 0);
  REQUIRE(answers["keyframes"].size() >= 1);
  for (const nlohmann::json& keyframe : answers["keyframes"]) {
    // Too short a way for three loops over 20 m.
    CHECK(keyframe["state"] == "not yet");
    CHECK_FALSE(keyframe["reason"].get<std::string>().empty());
    CHECK_FALSE(keyframe.contains("T_map_keyframe"));
  }
  CHECK(fs::file_size(poses) == 0);
  CHECK(store::StoreReader(project.store).check().empty());
  CHECK(store::StoreReader(project.store).project().epochs().size() == 2);
  CHECK_THAT(run_unimapper(localise).out,
             Contains("0 of") && Contains("keyframes localised in epoch 2"));
  check_fails(run_unimapper(localise, {"--out", poses}), "--replace overwrites it");
}

TEST_CASE("of a log with two sessions each is localised by itself, or the one with that name") {
  const Project project;
  const fs::path monday = project.run("monday", 12);
  const fs::path tuesday = project.run("tuesday", 12);
  project.done({"add", monday});
  project.done({"merge"});
  project.directory.write("both.lcmlog", read_text(monday / "keyframes.lcmlog") +
                                             read_text(tuesday / "keyframes.lcmlog"));
  const Words both = {"localise", project.directory / "both.lcmlog", "--store", project.store};
  check_fails(run_unimapper(both, {"--session", "sunday"}), "it holds monday, tuesday");
  CHECK_THAT(run_well(both, {"--session", "tuesday"}).out, !Contains("session monday"));
  check_fails(run_unimapper(both, {"--out", project.directory / "both.tum"}), "overlap in time");
  CHECK_THAT(run_well(both).out, Contains("session monday") && Contains("session tuesday"));
  const nlohmann::json all = nlohmann::json::parse(run_well(both, {"--json"}).out)["keyframes"];
  CHECK(all.front()["session"] == "monday");
  CHECK(all.back()["session"] == "tuesday");
  // The way goes on, the keyframes of tuesday are counted anew.
  CHECK(all.back()["keyframe"] < all.size() - 1);
  CHECK(std::is_sorted(all.begin(), all.end(),
                       [](const auto& a, const auto& b) { return a["path_m"] < b["path_m"]; }));
}

TEST_CASE("localisation without a store, a run or an epoch is refused in words") {
  const Project project;
  const std::string none = project.directory / "none";
  check_fails(run_unimapper({"localise", none, "--store", none}), "is no store");
  CHECK(run_unimapper({"localise", "--store", project.store}).exit_code == 2);
  const std::string monday = project.run("monday", 12);
  project.done({"add", monday});
  project.done({"merge"});
  check_fails(run_unimapper({"localise", none, "--store", project.store}), "");
  check_fails(run_unimapper({"localise", monday, "--store", project.store, "--epoch", "9"}), "");
}
