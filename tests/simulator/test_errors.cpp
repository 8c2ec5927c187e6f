// Tests of error messages for invalid configurations and failed writes.
#include <catch2/catch.hpp>

#include "run_folder.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

using Catch::Matchers::Contains;

SimulationConfig tiny_config() {
  SimulationConfig config;
  config.sensor = SensorKind::kVlp16;
  config.scans = 2;
  config.thin = 32;
  return config;
}

std::string message_of(const SimulationConfig& config, const std::filesystem::path& out) {
  try {
    simulate(config, out);
  } catch (const SimulationError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("an unknown scene, route, sensor or a senseless number is refused") {
  TemporaryDirectory folder;
  SimulationConfig config = tiny_config();
  config.scene = "moon";
  CHECK_THAT(
      message_of(config, folder.path()),
      Contains("unknown scene 'moon'; there are: town, campus, deck, square, convoy, street, "
               "tunnel, hall, bore, fixtures, decks, streets, corridor, courtyard, quad, orchard"));
  config = tiny_config();
  config.route = 'Z';
  CHECK_THAT(message_of(config, folder.path()), Contains("unknown route 'Z'"));
  config = tiny_config();
  config.sensor = SensorKind::kGeneric;
  CHECK_THAT(message_of(config, folder.path()), Contains("sensor 'generic'"));
  config = tiny_config();
  config.scans = 0;
  CHECK_THAT(message_of(config, folder.path()), Contains("number of scans"));
  config = tiny_config();
  config.thin = 0;
  CHECK_THAT(message_of(config, folder.path()), Contains("thinning"));
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("columns and rings are refused for a pattern without them and outside their ranges") {
  TemporaryDirectory folder;
  SimulationConfig config = tiny_config();
  config.sensor = SensorKind::kLivoxAvia;
  config.sampling.columns = 512;
  CHECK_THAT(message_of(config, folder.path()),
             Contains("livox-avia has a scan pattern of its own"));
  config.sampling = {.uneven_rings = true};
  CHECK_THAT(message_of(config, folder.path()), Contains("spinning LiDAR"));
  config = tiny_config();
  config.sampling.columns = 255;
  CHECK_THAT(message_of(config, folder.path()), Contains("256 to 2048"));
  config.sampling = {.rings = 129};
  CHECK_THAT(message_of(config, folder.path()), Contains("8 to 128"));
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("attitudes outside their ranges are refused") {
  TemporaryDirectory folder;
  const auto refused = [&](auto change) {
    SimulationConfig config = tiny_config();
    change(config);
    return message_of(config, folder.path());
  };
  CHECK_THAT(refused([](auto& c) { c.mount.pitch_deg = 50.0; }), Contains("within 45 degrees"));
  CHECK_THAT(refused([](auto& c) { c.mount.roll_deg = -50.0; }), Contains("within 45 degrees"));
  CHECK_THAT(refused([](auto& c) { c.attitude_noise.sigma_deg = -1.0; }), Contains("noise"));
  CHECK_THAT(refused([](auto& c) { c.attitude_noise.correlated_s = 61.0; }), Contains("seconds"));
  CHECK_THAT(refused([](auto& c) { c.sway.amplitude_deg = 21.0; }), Contains("sway"));
  CHECK_THAT(refused([](auto& c) { c.sway.amplitude_deg = 2.0; }), Contains("frequency"));
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("a file where the folder should be is reported by name") {
  TemporaryDirectory folder;
  const auto blocked = folder.path() / "blocked";
  std::ofstream(blocked) << "not a folder";
  const std::string message = message_of(tiny_config(), blocked);
  CHECK_THAT(message, Contains("cannot make the folder"));
  CHECK_THAT(message, Contains(blocked.string()));
}

TEST_CASE("a full disk is reported with the file that did not fit") {
  if (!std::filesystem::exists("/dev/full")) {
    WARN("skipped: this system has no /dev/full");
    return;
  }
  TemporaryDirectory folder;
  std::filesystem::create_directories(folder.path() / "scans");
  std::filesystem::create_symlink("/dev/full", folder.path() / "scans" / "000001.bin");
  const std::string message = message_of(tiny_config(), folder.path());
  CHECK_THAT(message, Contains("000001.bin"));
  CHECK_THAT(message, Contains("No space left on device"));
}

TEST_CASE("drift presets have names") {
  CHECK(parse_drift("lio") == DriftPreset::kLio);
  CHECK(parse_drift("none") == DriftPreset::kNone);
  CHECK(parse_drift("icp") == DriftPreset::kIcp);
  CHECK(parse_drift("bad") == DriftPreset::kBad);
  CHECK_FALSE(parse_drift("LIO ").has_value());
}
