// Tests of determinism: equal configurations write equal bytes.
#include "run_folder.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

/// Every file of a run, by name.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files[std::filesystem::relative(entry.path(), folder).string()] = read_bytes(entry.path());
  }
  return files;
}

SimulationConfig small_config(SensorKind sensor, std::uint32_t threads) {
  SimulationConfig config = short_drive(sensor, 5, 42);
  config.route = 'B';
  config.threads = threads;
  return config;
}

}  // namespace

TEST_CASE("the same seed writes the same bytes, whatever the number of threads", "[slow]") {
  const SensorKind sensor = GENERATE(SensorKind::kOs2_128, SensorKind::kLivoxAvia);
  const std::string scene =
      GENERATE("town", "campus", "deck", "street", "convoy", "corridor", "courtyard");
  TemporaryDirectory once;
  TemporaryDirectory again;
  SimulationConfig config = small_config(sensor, 1);
  config.scene = scene;
  if (scene == "courtyard") config.route = 'C';  // in its copy
  simulate(config, once.path());
  config.threads = 3;
  simulate(config, again.path());
  const auto files = contents(once.path());
  auto repeated = contents(again.path());
  REQUIRE(files.size() == 2 * 5 + 6);
  REQUIRE(repeated.size() == files.size());
  for (const auto& [name, bytes] : files) {
    INFO(name);
    CHECK((bytes == repeated[name]));
    CHECK(bytes.size() > 40);
  }
}

TEST_CASE("another seed is another town or campus") {
  SimulationConfig config = small_config(SensorKind::kVlp16, 0);
  config.scene = GENERATE("town", "campus");
  const Recording one(config);
  config.seed = 43;
  const Recording other(config);
  CHECK(one.bytes_of("gt_poses.txt") != other.bytes_of("gt_poses.txt"));
  CHECK(one.scans[2].size() != other.scans[2].size());
}

TEST_CASE("progress counts every scan once") {
  TemporaryDirectory folder;
  std::vector<std::uint32_t> seen;
  simulate(small_config(SensorKind::kVlp16, 2), folder.path(),
           [&](std::uint32_t done, std::uint32_t total) {
             CHECK(total == 5);
             seen.push_back(done);
           });
  CHECK(seen == std::vector<std::uint32_t>{1, 2, 3, 4, 5});
}
