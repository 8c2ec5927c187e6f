// End-to-end tests of stores: `unimapper inspect` and `unimapper merge` on them, refusals.
#include "ports/lcm/received_log.hpp"
#include "ports/store/keyframe_store.hpp"
#include "tests/apps/project.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Runs of small recordings, and a store of what their robots would have sent.
struct Fixture {
  TemporaryDirectory directory;
  std::string store = directory / "store";

  void receive(const std::string& run) const {
    store::KeyframeStore kept(store);
    wire::Receiver receiver({}, kept);
    REQUIRE(lcm_port::feed_event_log(receiver, fs::path(run) / "keyframes.lcmlog").empty());
    receiver.store_all();
    REQUIRE(kept.trouble().empty());
  }
  [[nodiscard]] CommandResult merge(const Words& arguments, const std::string& map) const {
    return run_unimapper({"merge", "--allow-unconnected", "--out", directory / map}, arguments);
  }
};

}  // namespace

TEST_CASE("a store merges to the same map as the runs that are in it, or as one session") {
  const Fixture fixture;
  const std::string a = make_run(fixture.directory, "a", 12);
  const std::string b = make_run(fixture.directory, "b", 14);
  for (const std::string& run : {a, b, a}) fixture.receive(run);
  const CommandResult of_runs = fixture.merge({a, b}, "of_runs");
  const CommandResult of_store = fixture.merge({fixture.store}, "of_store");
  INFO(of_runs.err << of_store.err);
  REQUIRE(of_runs.exit_code == 0);
  REQUIRE(of_store.exit_code == 0);
  CHECK((read_text(fixture.directory / "of_store/map.ply") ==
         read_text(fixture.directory / "of_runs/map.ply")));

  const auto sessions =
      nlohmann::json::parse(run_unimapper({"inspect", fixture.store, "--json"}).out)["sessions"];
  REQUIRE(sessions.size() == 2);
  const std::string name = sessions[0]["name"];
  const CommandResult one = fixture.merge({fixture.store, "--session", name}, "one");
  CHECK(one.exit_code == 0);
  CHECK_THAT(one.err, Contains("session " + name));
  CHECK_THAT(one.err, !Contains("session " + sessions[1]["name"].get<std::string>()));
  const CommandResult none = fixture.merge({fixture.store, "--session", "nobody"}, "none");
  check_fails(none, "--session names \"nobody\", but the stores have: ");
  CHECK_THAT(none.err, Contains(name));
}

TEST_CASE("a store is inspected: its sessions, and what is damaged") {
  const Fixture fixture;
  const std::string run = make_run(fixture.directory, "a", 12);
  fixture.receive(run);
  const Words inspect = {"inspect", fixture.store, "--check"};
  CHECK_THAT(run_well(inspect).out, Contains("store        1 sessions") &&
                                        Contains("0 missing, ended") &&
                                        Contains("every page and keyframe is sound"));
  const fs::path file = store::database_of(fixture.store);
  store::Database(file, store::Access::kWrite)
      .run("UPDATE keyframes SET bytes = zeroblob(length(bytes)) WHERE sequence = 0");
  const CommandResult damaged = run_unimapper(inspect);
  check_fails(damaged, "1 faults");
  CHECK_THAT(damaged.out, Contains("keyframe 0 of") && Contains("fails its checksum"));
  CHECK_THAT(fixture.merge({fixture.store}, "map").err,
             Contains("has 1 damaged keyframes, which are left out"));
}

TEST_CASE("a base refuses what is no store, and a store that another base writes to") {
  const Fixture fixture;
  const Words base = {"base", "--store", fixture.store, "--listen", "memq://"};
  {
    const store::KeyframeStore held(fixture.store);
    check_fails(run_unimapper(base), "a base writes to this store (process ");
  }
  const fs::path database = store::database_of(fixture.store);
  store::Database(database, store::Access::kWrite).run("PRAGMA user_version = 99");
  check_fails(run_unimapper(base), "newer version of Uni-Mapper (schema 99");
  write_text(database, std::string(5000, 'x'));
  check_fails(run_unimapper(base), "not a database");
  CHECK(run_unimapper({"base", "--store", fixture.store}).exit_code == 2);  // --listen is missing
}
