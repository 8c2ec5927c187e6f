// Tests of the epochs in which sessions moved.
#include "src/apps/view/pose_epochs.hpp"

#include "ports/store/project_writer.hpp"
#include "ports/store/store_reader.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/whole_session.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

namespace {

/// Two sessions whose merges put them where told.
struct Project {
  TemporaryDirectory folder;
  PoseEpochs epochs;

  Project() {
    Base base(folder.path());
    base.feed(wire_test::session_stream({{1, 11}, "alpha", "os2-128"}, 2));
    base.feed(wire_test::session_stream({{2, 22}, "beta", "vlp-16"}, 2));
    base.advance();
  }
  ~Project() { CHECK(StoreReader(folder.path()).check().empty()); }

  static MapResult result(const std::vector<double>& x_m) {
    MapResult made;
    made.parameters = "{}";
    for (std::size_t s = 0; s < x_m.size(); ++s) {
      Pose at;
      at.translation.x() = x_m[s];
      made.sessions.push_back({static_cast<std::int64_t>(s + 1),
                               s == 0 ? "central" : "merged",
                               "",
                               at,
                               {0, 1},
                               {at, at * at}});
    }
    return made;
  }
  static ProjectWriter::Change merged(ProjectWriter& writer, const std::vector<double>& x_m) {
    return [&writer, x_m](ProjectState& state) {
      state.epoch.result = writer.keep(result(x_m));
      return std::optional<std::string>("merged");
    };
  }
  [[nodiscard]] std::map<std::int64_t, std::int64_t> at(std::int64_t number) {
    StoreReader reader(folder.path());
    ProjectReader project = reader.project();
    return epochs.last_changed(project, project.epochs(), number);
  }
};

using Changed = std::map<std::int64_t, std::int64_t>;

}  // namespace

TEST_CASE("a session has changed in the latest epoch that moved it, undo included") {
  Project project;
  ProjectWriter writer(project.folder.path(), "a test");
  (void)writer.commit("merge", Project::merged(writer, {0.0}));
  (void)writer.commit("merge", Project::merged(writer, {0.0, 5.0}));
  const std::int64_t first_of_both = writer.current().epoch.result;
  (void)writer.commit("note", [](ProjectState&) { return std::optional<std::string>("said"); });
  (void)writer.commit("merge", Project::merged(writer, {0.0, 6.0}));
  (void)writer.commit("undo", [&](ProjectState& state) {
    state.epoch.result = first_of_both;
    return std::optional<std::string>("undone");
  });
  CHECK(project.at(1) == Changed{{1, 1}});
  CHECK(project.at(3) == Changed{{1, 1}, {2, 2}});
  CHECK(project.at(4) == Changed{{1, 1}, {2, 4}});
  CHECK(project.at(5) == Changed{{1, 1}, {2, 5}});
  CHECK(project.at(6).empty());
}

TEST_CASE("an epoch that is replaced is looked at anew") {
  Project project;
  ProjectWriter writer(project.folder.path(), "a test");
  (void)writer.commit("merge", Project::merged(writer, {0.0, 5.0}));
  (void)writer.commit("base", Project::merged(writer, {0.0, 5.0}));
  CHECK(project.at(2) == Changed{{1, 1}, {2, 1}});
  (void)writer.replace(2, Project::merged(writer, {0.0, 7.0}));
  CHECK(project.at(2) == Changed{{1, 1}, {2, 2}});
  (void)writer.replace(2, Project::merged(writer, {0.0, 5.0}));
  CHECK(project.at(2) == Changed{{1, 1}, {2, 1}});
}
