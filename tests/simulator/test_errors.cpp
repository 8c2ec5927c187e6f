// Tests of error messages for invalid configurations and failed writes.
#include "run_folder.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

using Catch::Matchers::Contains;

SimulationConfig tiny_config() { return short_drive(SensorKind::kVlp16, 2, 1, 32); }

std::string message_of(const SimulationConfig& config, const std::filesystem::path& out) {
  try {
    simulate(config, out);
  } catch (const SimulationError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace

TEST_CASE("what cannot be simulated is refused, before anything is written") {
  TemporaryDirectory folder;
  using Change = std::function<void(SimulationConfig&)>;
  const std::pair<Change, const char*> refused[] = {
      {[](auto& c) { c.scene = "moon"; },
       "unknown scene 'moon'; there are: town, campus, deck, square, convoy, street, tunnel, hall, "
       "bore, fixtures, decks, streets, corridor, courtyard, quad, orchard"},
      {[](auto& c) { c.route = 'Z'; }, "unknown route 'Z'"},
      {[](auto& c) { c.sensor = SensorKind::kGeneric; }, "sensor 'generic'"},
      {[](auto& c) { c.scans = 0; }, "number of scans"},
      {[](auto& c) { c.thin = 0; }, "thinning"},
      {[](auto& c) {
         c.sensor = SensorKind::kLivoxAvia;
         c.sampling.columns = 512;
       },
       "livox-avia has a scan pattern of its own"},
      {[](auto& c) {
         c.sensor = SensorKind::kLivoxAvia;
         c.sampling.uneven_rings = true;
       },
       "spinning LiDAR"},
      {[](auto& c) { c.sampling.columns = 255; }, "256 to 2048"},
      {[](auto& c) { c.sampling.rings = 129; }, "8 to 128"},
      {[](auto& c) { c.mount.pitch_deg = 50.0; }, "within 45 degrees"},
      {[](auto& c) { c.mount.roll_deg = -50.0; }, "within 45 degrees"},
      {[](auto& c) { c.attitude_noise.sigma_deg = -1.0; }, "noise"},
      {[](auto& c) { c.attitude_noise.correlated_s = 61.0; }, "seconds"},
      {[](auto& c) { c.sway.amplitude_deg = 21.0; }, "sway"},
      {[](auto& c) { c.sway.amplitude_deg = 2.0; }, "frequency"}};
  for (const auto& [change, reason] : refused) {
    SimulationConfig config = tiny_config();
    change(config);
    CHECK_THAT(message_of(config, folder.path()), Contains(reason));
  }
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
