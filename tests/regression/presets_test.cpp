// Presets: what they set otherwise than the defaults
#include "expected_text.hpp"
#include "tests/test.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/onboard/config.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

/// Lines of the dumped configuration that are not those of the defaults, with their struct.
std::string differences_text(const PipelineConfig& config) {
  const auto lines_of = [](const std::string& text) {
    std::map<std::string, std::string> lines;  // by struct and name
    std::istringstream stream(text);
    std::string inside;
    for (std::string line; std::getline(stream, line);) {
      const std::size_t first = line.find('"');
      const std::size_t colon = line.find(':');
      if (first == std::string::npos || colon == std::string::npos) continue;
      const std::string name = line.substr(first + 1, line.find('"', first + 1) - first - 1);
      if (line.back() == '{') {
        inside = name;
        continue;
      }
      std::string value = line.substr(colon + 2);
      if (value.back() == ',') value.pop_back();
      lines[inside + "." + name] = value;
    }
    return lines;
  };
  const auto defaults = lines_of(dump_config(PipelineConfig{}));
  std::string text;
  for (const auto& [name, value] : lines_of(dump_config(config))) {
    if (defaults.at(name) != value) text += "  " + name + " " + value + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("presets set what they set before", "[regression]") {
  std::string text;
  const char* computers[] = {"server", "jetson", "raspberry pi", "armv7"};
  for (const SensorModel& model : sensor_models()) {
    for (std::size_t c = 0; c < 4; ++c) {
      const PipelineConfig config = preset(model.kind, static_cast<Computer>(c));
      CHECK(config.validate().ok());
      text += line_of("preset", model.name, computers[c]) + differences_text(config);
    }
    text += line_of("preset", model.name, "paper") + differences_text(paper_preset(model.kind));
    text += line_of("preset", model.name, "indoors at 5 Hz") +
            differences_text(adapt_to(Surroundings::kIndoors, preset(model.kind), 0.2F));
  }
  text += "os1-64 with 2048 columns\n" +
          differences_text(preset(SensorKind::kOs1_64, Computer::kJetson, 2048));
  SensorModel model;
  model.name = "my own";
  model.horizontal_fov_deg = 270.0F;
  model.elevation_min_deg = -35.0F;
  model.elevation_max_deg = 12.0F;
  model.range_min_m = 0.8F;
  model.range_max_m = 70.0F;
  model.rings = 40;
  model.points_per_scan = 50000;
  model.scan_rate_hz = 15.0F;
  for (const ScanPattern pattern :
       {ScanPattern::kSpinning, ScanPattern::kRaster, ScanPattern::kNonRepetitive}) {
    model.pattern = pattern;
    const Expected<PipelineConfig> config = preset(model, Computer::kRaspberryPi);
    REQUIRE(config.ok());
    text += line_of("my own", static_cast<int>(pattern)) + differences_text(*config);
  }
  check_expected("presets", text);
}
