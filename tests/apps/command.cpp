#include "tests/apps/command.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>

#include "ports/datasets/files.hpp"
#include "ports/datasets/writers.hpp"

extern char** environ;

namespace unimapper::apps {

namespace fs = std::filesystem;

pid_t start(const char* program, const Words& arguments, int out, int err) {
  Words words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t process = 0;
  const int failure = posix_spawn(&process, program, &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  REQUIRE(failure == 0);
  return process;
}

CommandResult run_unimapper(const Words& arguments, const Words& more) {
  const TemporaryDirectory scratch;
  const auto open_file = [&](const char* name) {
    return open((scratch / name).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  };
  const int out = open_file("out");
  const int err = open_file("err");
  Words all = arguments;
  all.insert(all.end(), more.begin(), more.end());
  const pid_t process = start(UNIMAPPER_BINARY, all, out, err);
  close(out);
  close(err);
  int status = 0;
  REQUIRE(waitpid(process, &status, 0) == process);
  // -1 where a signal ended it
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(scratch / "out"),
          read_text(scratch / "err")};
}

CommandResult run_well(const Words& arguments, const Words& more) {
  CommandResult result = run_unimapper(arguments, more);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  return result;
}

void check_fails(const CommandResult& result, const std::string& message, int exit_code) {
  INFO(result.out << result.err);
  CHECK(result.exit_code == exit_code);
  CHECK_THAT(result.err, Catch::Contains(message));
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

std::vector<std::vector<double>> read_rows(const fs::path& file) {
  std::vector<std::vector<double>> rows;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream text(line);
    rows.emplace_back(std::istream_iterator<double>(text), std::istream_iterator<double>());
  }
  return rows;
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
                     const SmallRecording& recording, const Words& more) {
  const fs::path dataset = directory / (name + "-data");
  std::string run = directory / name;
  recording.write(dataset);
  (void)run_well({"onboard", dataset, "--out", run, "--sensor", "vlp-16"}, more);
  return run;
}

std::string make_run(const TemporaryDirectory& directory, const std::string& name,
                     std::size_t scans) {
  return make_run(directory, name, SmallRecording(scans));
}

LabelPairs label_pairs(const fs::path& first, const fs::path& second) {
  LabelPairs pairs;
  for (const fs::path& file : datasets::list_files(first / "labels", ".label")) {
    const std::string a = read_text(file);
    const std::string b = read_text(second / "labels" / file.filename());
    REQUIRE(a.size() == b.size());
    for (std::size_t i = 0; i < a.size(); i += 4) {
      ++pairs.all;
      pairs.equal += a[i] == b[i] ? 1 : 0;
      pairs.dynamic += a[i] == '\xFB' ? 1 : 0;
    }
  }
  return pairs;
}

}  // namespace unimapper::apps
