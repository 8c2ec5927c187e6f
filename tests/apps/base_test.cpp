// End-to-end tests of stores: `unimapper inspect` and `unimapper merge` on them, refusals.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "ports/lcm/received_log.hpp"
#include "ports/store/keyframe_store.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Runs of small recordings, and a store of what their robots would have sent.
struct Fixture {
  TemporaryDirectory directory;
  std::string store = (directory / "store").string();

  std::string run(const std::string& name, std::size_t scans) const {
    const fs::path dataset = directory / (name + "-data");
    const fs::path run = directory / name;
    SmallRecording(scans).write(dataset);
    const CommandResult result =
        run_unimapper({"onboard", dataset.string(), "--out", run.string(), "--sensor", "vlp-16"});
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return run.string();
  }
  void receive(const std::string& run) const {
    store::KeyframeStore kept(store);
    wire::Receiver receiver({}, kept);
    REQUIRE(lcm_port::feed_event_log(receiver, fs::path(run) / "keyframes.lcmlog").empty());
    receiver.store_all();
    REQUIRE(kept.trouble().empty());
  }
  CommandResult merge(std::vector<std::string> arguments, const std::string& map) const {
    arguments.insert(arguments.begin(), "merge");
    arguments.insert(arguments.end(), {"--allow-unconnected", "--out", (directory / map).string()});
    return run_unimapper(arguments);
  }
};

}  // namespace

TEST_CASE("a store merges to the same map as the runs that are in it") {
  const Fixture fixture;
  const std::string a = fixture.run("a", 12);
  const std::string b = fixture.run("b", 14);
  fixture.receive(a);
  fixture.receive(b);
  fixture.receive(a);  // again
  const CommandResult of_runs = fixture.merge({a, b}, "of_runs");
  const CommandResult of_store = fixture.merge({fixture.store}, "of_store");
  INFO(of_runs.err << of_store.err);
  REQUIRE(of_runs.exit_code == 0);
  REQUIRE(of_store.exit_code == 0);
  CHECK(read_text(fixture.directory / "of_store/map.ply") ==
        read_text(fixture.directory / "of_runs/map.ply"));

  SECTION("one session of it by name") {
    const auto sessions =
        nlohmann::json::parse(run_unimapper({"inspect", fixture.store, "--json"}).out)["sessions"];
    REQUIRE(sessions.size() == 2);
    const std::string name = sessions[0]["name"];
    const CommandResult one = fixture.merge({fixture.store, "--session", name}, "one");
    CHECK(one.exit_code == 0);
    CHECK_THAT(one.err, Contains("session " + name));
    CHECK_THAT(one.err, !Contains("session " + sessions[1]["name"].get<std::string>()));
    const CommandResult none = fixture.merge({fixture.store, "--session", "nobody"}, "none");
    CHECK(none.exit_code == 1);
    CHECK_THAT(none.err,
               Contains("--session names \"nobody\", but the stores have: ") && Contains(name));
  }
}

TEST_CASE("a store is inspected: its sessions, and what is damaged") {
  const Fixture fixture;
  const std::string run = fixture.run("a", 12);
  fixture.receive(run);
  const CommandResult sound = run_unimapper({"inspect", fixture.store, "--check"});
  CHECK(sound.exit_code == 0);
  CHECK_THAT(sound.out, Contains("store        1 sessions") && Contains("0 missing, ended") &&
                            Contains("every page and keyframe is sound"));
  const fs::path file = store::database_of(fixture.store);
  store::Database(file, store::Access::kWrite)
      .run("UPDATE keyframes SET bytes = zeroblob(length(bytes)) WHERE sequence = 0");
  const CommandResult damaged = run_unimapper({"inspect", fixture.store, "--check"});
  CHECK(damaged.exit_code == 1);
  CHECK_THAT(damaged.out, Contains("keyframe 0 of") && Contains("fails its checksum"));
  CHECK_THAT(damaged.err, Contains("1 faults"));
  const CommandResult merged = fixture.merge({fixture.store}, "map");
  CHECK_THAT(merged.err, Contains("has 1 damaged keyframes, which are left out"));
}

TEST_CASE("a base refuses what is no store, and a store that another base writes to") {
  const Fixture fixture;
  const auto base = [&fixture] {
    return run_unimapper({"base", "--store", fixture.store, "--listen", "memq://"});
  };
  {
    const store::KeyframeStore held(fixture.store);
    const CommandResult second = base();
    CHECK(second.exit_code == 1);
    CHECK_THAT(second.err, Contains("a base writes to this store (process "));
  }
  store::Database(store::database_of(fixture.store), store::Access::kWrite)
      .run("PRAGMA user_version = 99");
  const CommandResult newer = base();
  CHECK(newer.exit_code == 1);
  CHECK_THAT(newer.err, Contains("newer version of Uni-Mapper (schema 99"));
  write_text(fs::path(fixture.store) / "store.sqlite", std::string(5000, 'x'));
  const CommandResult foreign = base();
  CHECK(foreign.exit_code == 1);
  CHECK_THAT(foreign.err, Contains("not a database"));
  CHECK(run_unimapper({"base", "--store", fixture.store}).exit_code == 2);  // --listen is missing
}
