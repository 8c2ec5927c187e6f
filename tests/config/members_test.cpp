// Every member of the configurations, set by its name in JSON and read from the struct.
#include <catch2/catch.hpp>

#include "tests/config/merge_members.hpp"
#include "tests/config/pipeline_members.hpp"
#include "unimapper/config/config_json.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// {"a": {"b": TEXT}} for "a.b".
template <typename Config>
void set_by_json(Config& config, const std::string& name, const std::string& text) {
  std::string json = text == "only_same" ? "\"" + text + "\"" : text;
  std::size_t end = name.size();
  while (end != std::string::npos) {
    const std::size_t dot = name.rfind('.', end - 1);
    const std::size_t begin = dot == std::string::npos ? 0 : dot + 1;
    json = "{\"" + name.substr(begin, end - begin) + "\": " + json + "}";
    end = dot;
  }
  read_parameters(json, "test", kParameters<Config>, &config);
}

}  // namespace

TEST_CASE("a key in JSON sets the robot's member of that name and no other") {
  CHECK(wrong_members(pipeline_members(), set_by_json<PipelineConfig>).empty());
}

TEST_CASE("a key in JSON sets the merger's member of that name and no other") {
  CHECK(wrong_members(merge_members(), set_by_json<merge::MergeConfig>).empty());
}
