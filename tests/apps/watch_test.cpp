// End-to-end tests of `unimapper onboard --share` and `unimapper watch`.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <thread>

#include "src/apps/watch/keyframe_text.hpp"
#include "tests/apps/command.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::shared_memory;
using Catch::Matchers::Contains;

TEST_CASE("What onboard shares is watched, and nothing stays in shared memory") {
  const TemporaryDirectory directory;
  SmallRecording(30).write(directory / "recording");
  const Words onboard = {"onboard", directory / "recording", "--sensor", "vlp-16", "--out"};
  // A name that cannot be shared is refused before anything is mapped.
  check_fails(run_unimapper(onboard, {directory / "refused", "--share", "a/b"}),
              "--share a/b: names of shares");
  CHECK_FALSE(std::filesystem::exists(directory / "refused/run.json"));  // no --replace is needed
  const std::string share = "watched-" + std::to_string(getpid());
  CommandResult watched;
  std::thread watching([&] {
    watched = run_unimapper({"watch", share, "--wait", "60", "--oldest"});
  });
  const CommandResult shared =
      run_unimapper(onboard, {directory / "run", "--share", share, "--realtime"});
  watching.join();
  CHECK(shared.exit_code == 0);
  CHECK_THAT(shared.err, Contains(" 0 allocations"));
  CHECK(watched.err.empty());
  CHECK(watched.exit_code == 0);
  CHECK_THAT(watched.out, Contains("keyframe 0 at ") && Contains("keyframe 1 at ") &&
                              Contains("keyframe 2 at ") && Contains(" 0 missed"));
  CHECK_THAT(watched.out, Contains("health    30 scans, 0 refused; 3 keyframes"));
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm")) {
    CHECK_THAT(entry.path().string(), !Contains(share));
  }
}

TEST_CASE("Watching a robot that is not there is refused with a sentence") {
  check_fails(run_unimapper({"watch", "nobody-" + std::to_string(getpid())}),
              "nobody has published this topic on this computer");
}

TEST_CASE("The view from above has the sensor in the middle, its left at the top") {
  const std::array<SharedCell, 4> cells{
      {{{5, 0, 0}, 1, 0, 0}, {{0, 5, 0}, 1, 1, 0}, {{-100, 0, 0}, 1, 0, 0}, {{0, 0, 0}, 1, 0, 0}}};
  const SharedCell moving{{0, -5, 0}, 1, 0, 0};
  KeyframeMessage keyframe;
  keyframe.static_cells = {reinterpret_cast<const std::byte*>(cells.data()), cells.size(), 16};
  keyframe.dynamic_cells = {reinterpret_cast<const std::byte*>(&moving), 1, 16};
  const std::vector<std::string> picture = view_from_above(keyframe, 40, 20, 40.0);
  REQUIRE(picture.size() == 20);
  CHECK(picture[10][20] == '>');
  CHECK(picture[10][25] == '#');
  CHECK(picture[7][20] == '.');
  CHECK(picture[12][20] == '*');
  std::size_t drawn = 0;
  for (const std::string& row : picture) {
    REQUIRE(row.size() == 40);
    drawn += row.size() - static_cast<std::size_t>(std::count(row.begin(), row.end(), ' '));
  }
  CHECK(drawn == 4);
}
