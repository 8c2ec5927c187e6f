// Configurations as JSON.
#include "tests/test.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;
using Catch::Matchers::Contains;

namespace {

template <typename Config>
std::string refused(const std::string& text) {
  Config config;
  try {
    parse_config(text, "file.json", config);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a configuration that was written reads back as the same") {
  for (const SensorModel& sensor : sensor_models()) {
    const PipelineConfig from = paper_preset(sensor.kind);
    PipelineConfig to;
    parse_config(dump_config(from), "file.json", to);
    CHECK(std::memcmp(&from.removal, &to.removal, sizeof from.removal) == 0);
    CHECK(dump_config(to) == dump_config(from));
  }
  merge::MergeConfig from;
  from.acceptance.loop_chi2 = 22.46;
  from.threads = 3;
  merge::MergeConfig to;
  parse_config(dump_config(from), "file.json", to);
  CHECK(to.acceptance.loop_chi2 == 22.46);
  CHECK(to.threads == 3);
  CHECK(dump_config(to) == dump_config(from));
}

TEST_CASE("a file changes what it names and nothing else") {
  merge::MergeConfig config;
  parse_config(R"({"acceptance": {"min_loops": 4}, "radius": {"radius_m": 7.5}})", "", config);
  CHECK(config.acceptance.min_loops == 4);
  CHECK(config.radius.radius_m == 7.5);
  config.acceptance.min_loops = 3;
  config.radius.radius_m = 10.0;
  CHECK(dump_config(config) == dump_config(merge::MergeConfig{}));
}

TEST_CASE("wrong files are refused by key, with the range or the name that was meant") {
  for (const auto& [text, message] :
       {std::pair{R"({"acceptance": {"min_lops": 4}})",
                  "acceptance.min_lops is no parameter; did you mean acceptance.min_loops?"},
        {R"({"acceptance": {"min_loops": 1}})",
         "acceptance.min_loops is 1 but must lie in [2, 100] loops"},
        {R"({"acceptance": [1]})", "acceptance must be an object"},
        {R"({"radius": {"radius_m": null}})",
         "radius.radius_m is null but must lie in [0.5, 100] m"}}) {
    CHECK(refused<merge::MergeConfig>(text) == std::string("file.json: ") + message);
  }
  CHECK(refused<merge::MergeConfig>(R"({"loops.min_overlap": 0.5})") == "accepted");
  // What only code sets.
  CHECK_THAT(refused<merge::MergeConfig>(R"({"graph": {"max_iterations": 7}})"),
             Contains("graph.max_iterations is no parameter"));
  CHECK_THAT(refused<PipelineConfig>("[]"), Contains("file.json: the file must be an object"));
  CHECK_THAT(refused<PipelineConfig>("{"), Contains("file.json: parse error"));
  // No JSON, or a number beyond all bounds.
  for (const char* text : {"", "{", "{\"budget_us\": 1e999}", "8e8888", "[1, 2", "\xFF"}) {
    INFO(text);
    CHECK_THAT(refused<PipelineConfig>(text), Contains("file.json: "));
  }
  // Values that do not fit each other.
  CHECK_THAT(refused<PipelineConfig>(R"({"voxel": {"coarse_size_m": 4.1}})"),
             Contains("voxel.coarse_size_m must be 2 to 64 times voxel.fine_size_m"));
  CHECK_THAT(refused<merge::MergeConfig>(R"({"acceptance": {"min_strong_loops": 4}})"),
             Contains("acceptance.min_strong_loops must not exceed acceptance.min_loops"));
  CHECK_THAT(refused<PipelineConfig>(R"({"removal": {"component_dynamic_share": 0.05}})"),
             Contains("removal.component_dynamic_share is 0.05 but must lie in [0.1, 1]"));
}

TEST_CASE("sizes that must agree are given once") {
  for (const char* name :
       {"descriptor.voxel_size_m", "descriptor.max_cells", "loop_search.voxel_size_m",
        "loop_search.max_keypoints", "loop_search.max_planes"}) {
    CHECK(find_parameter(kParameters<PipelineConfig>, name) == nullptr);
  }
  PipelineConfig config;
  parse_config(R"({"voxel": {"coarse_size_m": 4, "max_cells": 1000},
                   "descriptor": {"max_keypoints": 64, "max_planes": 99}})",
               "", config);
  CHECK(config.descriptor_input().voxel_size_m == 4.0F);
  CHECK(config.descriptor_input().max_cells == 1000);
  CHECK(config.place_shape().voxel_size_m == 4.0F);
  CHECK(config.place_shape().max_keypoints == 64);
  CHECK(config.place_shape().max_planes == 99);
}

TEST_CASE("the Markdown has a row for every parameter") {
  const PipelineConfig defaults;
  const std::string page = parameters_as_markdown(kParameters<PipelineConfig>, &defaults);
  CHECK_THAT(page, Contains("### loop_search.triangles\n") &&
                       Contains("| `removal.window` | 10 | [1, 32] | keyframes | N: earlier"));
  for (const Parameter& parameter : kParameters<PipelineConfig>) {
    CHECK_THAT(page, Contains("| `" + std::string(parameter.name.view()) + "` |"));
  }
}
