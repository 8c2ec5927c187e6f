// End-to-end tests of `unimapper localise`: answers, and mistakes that are told in words.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "ports/store/store_reader.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

void done(const std::vector<std::string>& arguments) {
  const CommandResult result = run_unimapper(arguments);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
}

}  // namespace

TEST_CASE("a short run is answered keyframe by keyframe, and the store is left as it is") {
  const TemporaryDirectory directory;
  const std::string store = (directory / "store").string();
  done({"map", "create", "--store", store});
  done({"map", "add", "--store", store, make_run(directory, "monday", 34)});
  const std::string tuesday = make_run(directory, "tuesday", 12);
  const CommandResult none = run_unimapper({"localise", tuesday, "--store", store});
  CHECK(none.exit_code == 1);
  CHECK_THAT(none.err, Contains("`unimapper map merge` makes one"));
  done({"map", "merge", "--store", store});
  const fs::path poses = directory / "tuesday.tum";
  const CommandResult result =
      run_unimapper({"localise", tuesday, "--store", store, "--json", "--out", poses.string()});
  REQUIRE(result.exit_code == 0);
  const nlohmann::json answers = nlohmann::json::parse(result.out);
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
  CHECK(store::StoreReader(store).check().empty());
  CHECK(store::StoreReader(store).project().epochs().size() == 2);
  CHECK_THAT(run_unimapper({"localise", tuesday, "--store", store}).out,
             Contains("0 of") && Contains("keyframes localised in epoch 2"));
  const CommandResult again =
      run_unimapper({"localise", tuesday, "--store", store, "--out", poses.string()});
  CHECK(again.exit_code == 1);
  CHECK_THAT(again.err, Contains("--replace overwrites it"));
}

TEST_CASE("localisation without a store, a run or an epoch is refused in words") {
  const TemporaryDirectory directory;
  const std::string store = (directory / "store").string();
  const CommandResult nowhere =
      run_unimapper({"localise", (directory / "run").string(), "--store", store});
  CHECK(nowhere.exit_code == 1);
  CHECK_THAT(nowhere.err, Contains("is no store"));
  CHECK(run_unimapper({"localise", "--store", store}).exit_code == 2);
  done({"map", "create", "--store", store});
  done({"map", "add", "--store", store, make_run(directory, "monday", 12)});
  done({"map", "merge", "--store", store});
  CHECK(run_unimapper({"localise", (directory / "run").string(), "--store", store}).exit_code == 1);
  CHECK(
      run_unimapper({"localise", (directory / "monday").string(), "--store", store, "--epoch", "9"})
          .exit_code == 1);
}
