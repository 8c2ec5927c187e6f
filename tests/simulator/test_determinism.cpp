// Tests of determinism: equal configurations write equal bytes.
#include <algorithm>
#include <catch2/catch.hpp>

#include "run_folder.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

/// Every file of a run, by name.
std::vector<std::pair<std::string, std::string>> contents(const std::filesystem::path& folder) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files.emplace_back(std::filesystem::relative(entry.path(), folder).string(),
                       read_bytes(entry.path()));
  }
  std::sort(files.begin(), files.end());
  return files;
}

SimulationConfig small_config(SensorKind sensor, std::uint32_t threads) {
  SimulationConfig config;
  config.sensor = sensor;
  config.route = 'B';
  config.scans = 5;
  config.thin = 16;
  config.seed = 42;
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
  REQUIRE(files.size() == 2 * 5 + 6);
  const auto repeated = contents(again.path());
  REQUIRE(repeated.size() == files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    INFO(files[i].first);
    CHECK(files[i].first == repeated[i].first);
    CHECK((files[i].second == repeated[i].second));
    CHECK(files[i].second.size() > 40);
  }
}

TEST_CASE("another seed is another town or campus") {
  TemporaryDirectory one;
  TemporaryDirectory other;
  SimulationConfig config = small_config(SensorKind::kVlp16, 0);
  config.scene = GENERATE("town", "campus");
  simulate(config, one.path());
  config.seed = 43;
  simulate(config, other.path());
  CHECK(read_bytes(one.path() / "gt_poses.txt") != read_bytes(other.path() / "gt_poses.txt"));
  CHECK(read_scan(one.path(), 2).size() != read_scan(other.path(), 2).size());
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
