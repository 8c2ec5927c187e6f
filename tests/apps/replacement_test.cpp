// Tests of outputs that take the position of earlier ones when they are whole, and not before.
#include "src/apps/replacement.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <random>

#include "tests/apps/command.hpp"
#include "tests/ports/store/memory_folder.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

/// Names of everything in a folder, hidden files too.
Words names_in(const fs::path& folder) {
  Words names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// A map with one trajectory of that name.
void write_map(const fs::path& folder, const std::string& name) {
  write_text(folder / "map.ply", name);
  write_text(folder / ("trajectories/" + name + ".tum"), name);
}

void replace_map(const fs::path& folder, const std::string& name) {
  FolderReplacement map(folder, Output::kMap);
  write_map(map.path(), name);
  map.publish();
}

void check_map(const fs::path& folder, const std::string& name) {
  CHECK(read_text(folder / "map.ply") == name);
  CHECK(names_in(folder / "trajectories") == Words{name + ".tum"});
}

/// What a process prints until it is killed.
class Process {
 public:
  explicit Process(const Words& arguments) {
    int pipe_ends[2];
    REQUIRE(pipe2(pipe_ends, O_CLOEXEC) == 0);
    process_ = start(REPLACEMENT_PROGRAM, arguments, pipe_ends[1], STDERR_FILENO);
    close(pipe_ends[1]);
    output_ = pipe_ends[0];
  }
  ~Process() { close(output_); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void await_line() {
    pollfd output{output_, POLLIN, 0};
    REQUIRE(poll(&output, 1, 20000) == 1);
  }
  /// The last number it printed; 0 without any.
  int kill_now() {
    kill(process_, SIGKILL);
    int status = 0;
    REQUIRE(waitpid(process_, &status, 0) == process_);
    REQUIRE(WIFSIGNALED(status));
    std::string text;
    char bytes[4096];
    for (ssize_t n = 0; (n = read(output_, bytes, sizeof bytes)) > 0;) {
      text.append(bytes, static_cast<std::size_t>(n));
    }
    if (text.empty()) return 0;
    const std::size_t before = text.rfind('\n', text.size() - 2);
    return std::atoi(text.c_str() + (before == std::string::npos ? 0 : before + 1));
  }

 private:
  pid_t process_ = 0;
  int output_ = -1;
};

}  // namespace

TEST_CASE("a process that replaces a map and is killed at any moment leaves a whole one") {
  const store::store_test::MemoryFolder directory;
  const fs::path folder = directory.path() / "map";
  std::mt19937 random(5);
  int number = 0;
  for (int kill_number = 0; kill_number < 100; ++kill_number) {
    Process process({folder.string(), std::to_string(number + 1)});
    if (kill_number % 4 == 0) process.await_line();
    usleep(static_cast<useconds_t>(random() % 15000));
    const int published = process.kill_now();
    if (!fs::exists(folder)) {
      REQUIRE((number == 0 && published == 0));
      continue;
    }
    const int found = std::atoi(read_text(folder / "summary.json").c_str());
    REQUIRE(found >= std::max(number, published));
    number = found;
    const std::string line = std::to_string(number) + "\n";
    const std::string map = read_text(folder / "map.ply");
    REQUIRE(map.size() == 20000 * line.size());
    REQUIRE(map.substr(0, line.size()) == line);
    REQUIRE(map.substr(map.size() - line.size()) == line);
    REQUIRE(names_in(folder) == Words{"map.ply", "summary.json", "trajectories"});
    REQUIRE(names_in(folder / "trajectories") == Words{std::to_string(number) + ".tum"});
  }
  CHECK(number > 20);
  // What killed processes left beside it goes with the next map.
  replace_map(folder, "last");
  CHECK(names_in(directory.path()) == Words{"map"});
}

TEST_CASE("what is not published changes nothing and leaves nothing") {
  const TemporaryDirectory directory;
  const fs::path folder = directory / "map";
  replace_map(folder, "first");
  {
    FolderReplacement map(folder, Output::kMap);
    write_map(map.path(), "second");
  }
  check_map(folder, "first");
  {
    FileReplacement file(directory / "scene.mcap");
    write_text(file.path(), "half");
  }
  CHECK(names_in(directory.path()) == Words{"map"});
}

TEST_CASE("files of others stay beside a map that is replaced, earlier sessions do not") {
  const TemporaryDirectory directory;
  const fs::path folder = directory / "map";
  replace_map(folder, "first");
  write_text(folder / "note.txt", "mine");
  write_text(folder / "trajectories/note.txt", "mine too");
  fs::create_symlink("nowhere", folder / "link");
  SECTION("in one step") {}
  SECTION("file by file, where others have a folder") {
    write_text(folder / "photos/1.jpg", "picture");
  }
  const bool in_one_step = !fs::exists(folder / "photos");
  const fs::file_status before = fs::status(folder);
  replace_map(folder, "second");
  CHECK(read_text(folder / "map.ply") == "second");
  CHECK(names_in(folder / "trajectories") == Words{"note.txt", "second.tum"});
  CHECK(read_text(folder / "note.txt") == "mine");
  CHECK(fs::read_symlink(folder / "link") == "nowhere");
  CHECK(fs::status(folder).permissions() == before.permissions());
  if (!in_one_step) CHECK(read_text(folder / "photos/1.jpg") == "picture");
  CHECK(names_in(directory.path()) == Words{"map"});
  CHECK_FALSE(fs::exists(folder / ".unimapper-new"));
}

TEST_CASE("a map goes through a link, with a slash at the end, and into a new folder") {
  const TemporaryDirectory directory;
  replace_map(directory / "new/folder/", "first");
  check_map(directory / "new/folder", "first");
  fs::create_symlink("new/folder", directory / "link");
  replace_map(directory / "link", "second");
  CHECK(fs::is_symlink(directory / "link"));
  check_map(directory / "new/folder", "second");
}

TEST_CASE("what cannot be written is found before the work, and a second writer, too") {
  const TemporaryDirectory directory;
  write_text(directory / "file", "");
  CHECK_THROWS_WITH(FolderReplacement(directory / "file", Output::kMap),
                    Contains("Not a directory"));
  CHECK_THROWS_WITH(FolderReplacement(directory / "file/map", Output::kMap),
                    Contains("Not a directory"));
  CHECK_THROWS_WITH(FileReplacement(directory / "file/scene.mcap"), Contains("Not a directory"));
  CHECK_THROWS_WITH(FileReplacement(directory.path()), Contains("Is a directory"));
  CHECK_THROWS(FolderReplacement("/proc/self/map", Output::kMap));
  CHECK_THROWS(FileReplacement("/proc/self/scene.mcap"));

  const FolderReplacement first(directory / "map", Output::kMap);
  CHECK_THROWS_WITH(FolderReplacement(directory / "map", Output::kMap),
                    Contains("another process is writing there"));
  const FileReplacement file(directory / "scene.mcap");
  CHECK_THROWS_WITH(FileReplacement(directory / "scene.mcap"),
                    Contains("another process is writing there"));
}

TEST_CASE("the command leaves the earlier map where the disk is full") {
  const TemporaryDirectory directory;
  const std::string run = make_run(directory, "run", 12);
  const fs::path map = directory / "map";
  (void)run_well({"merge", run, "--out", map});
  const std::string before = read_text(map / "map.ply");
  REQUIRE(before.size() > 30000);

  rlimit unlimited{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &unlimited) == 0);
  const rlimit small{20000, unlimited.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
  const CommandResult full = run_unimapper({"merge", run, "--out", map, "--replace"});
  REQUIRE(setrlimit(RLIMIT_FSIZE, &unlimited) == 0);
  std::signal(SIGXFSZ, handler);
  check_fails(full, "cannot be written (disk full?)");
  CHECK((read_text(map / "map.ply") == before));
  CHECK(names_in(directory.path()) == Words{"map", "run", "run-data"});

  const CommandResult nowhere =
      run_unimapper({"merge", run, "--out", directory / "run-data/poses.txt/map"});
  check_fails(nowhere, "Not a directory");
  CHECK_THAT(nowhere.err, !Contains("loops"));
}
