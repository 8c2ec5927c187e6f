#include "tests/apps/command.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>

#include "ports/datasets/writers.hpp"

extern char** environ;

namespace unimapper::apps {

namespace fs = std::filesystem;

CommandResult run_unimapper(const std::vector<std::string>& arguments) {
  const TemporaryDirectory scratch;
  const fs::path out = scratch.path() / "out";
  const fs::path err = scratch.path() / "err";
  std::vector<std::string> words = {UNIMAPPER_BINARY};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT, 0600);
  pid_t process = 0;
  const int spawned =
      posix_spawn(&process, UNIMAPPER_BINARY, &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  REQUIRE(spawned == 0);
  int status = 0;
  REQUIRE(waitpid(process, &status, 0) == process);
  CommandResult result;
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);  // -1 where a signal ended it
  result.out = read_text(out);
  result.err = read_text(err);
  return result;
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

SmallRecording::SmallRecording(std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    datasets::Scan scan;
    // Ground 2 m below the sensor, walls 6 m to both sides; a little denser with every scan, so
    // that scans differ in their number of points.
    const float step = 0.5F - 0.005F * static_cast<float>(i);
    for (float x = -10.0F; x <= 10.0F; x += step) {
      for (float y = -6.0F; y <= 6.0F; y += step) scan.points.push_back({x, y, -2.0F, 0.1F});
      for (float z = -2.0F; z <= 2.0F; z += step) {
        scan.points.push_back({x, -6.0F, z, 0.5F});
        scan.points.push_back({x, 6.0F, z, 0.5F});
      }
    }
    scans.push_back(std::move(scan));
    Pose pose;
    pose.translation.x() = static_cast<double>(i);
    poses.push_back(pose);
    stamps_ns.push_back(1'000'000'000 + static_cast<std::int64_t>(i) * 100'000'000);
  }
}

void SmallRecording::write(const fs::path& directory) const {
  datasets::make_directory(directory / "scans");
  for (std::size_t i = 0; i < scans.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06u.bin", static_cast<unsigned>(i));
    datasets::write_kitti_scan(directory / "scans" / name, scans[i].points);
  }
  datasets::write_kitti_poses(directory / "poses.txt", poses);
  datasets::write_times(directory / "times.txt", stamps_ns);
}

std::string make_run(const TemporaryDirectory& directory, const std::string& name,
                     std::size_t scans) {
  const fs::path dataset = directory / (name + "-data");
  const std::string run = (directory / name).string();
  SmallRecording(scans).write(dataset);
  const CommandResult result =
      run_unimapper({"onboard", dataset.string(), "--out", run, "--sensor", "vlp-16"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  return run;
}

}  // namespace unimapper::apps
