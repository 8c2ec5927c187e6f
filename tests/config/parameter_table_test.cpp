// Parameter tables: ranges, texts, misspelt names.
#include "unimapper/core/parameter_table.hpp"

#include "tests/test.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::test {

struct Inner {
  std::uint32_t count = 3;
  std::uint32_t rounds = 7;
  double exact = 0.5;
};
consteval auto parameters_of(const Inner*) {
  return parameter_table(parameter<&Inner::count>("[2, 5]", "things", "choice", "How many."),
                         internal_parameter<&Inner::rounds>("[1, 9]"),
                         parameter<&Inner::exact>("(0, 1]", "m", "choice", "How long."));
}

struct Outer {
  enum class Mode : std::uint8_t { kFast, kSafe };
  float step_m = 0.2F;
  bool on = false;
  Mode mode = Mode::kFast;
  Inner inner;
  void (*callback)() = nullptr;
};
inline constexpr std::array<std::string_view, 2> kModes = {"fast", "safe"};
consteval std::span<const std::string_view> choices_of(const Outer::Mode*) { return kModes; }
consteval auto parameters_of(const Outer*) {
  return parameter_table(parameter<&Outer::step_m>("0 or [0.2, 2]", "m", "paper", "A step."),
                         parameter<&Outer::on>("choice", "A switch."),
                         parameter<&Outer::mode>("choice", "A choice."),
                         parameters_in<&Outer::inner>(), no_parameter<&Outer::callback>());
}

namespace {

constexpr const auto& kTable = kParameters<Outer>;

const char* refused(const Outer& config) {
  const Error error = check_ranges(config);
  return error.code == ErrorCode::kInvalidConfig ? error.message : "";
}

bool set(Outer& config, const char* name, const char* text) {
  ParameterMessage message;
  return set_parameter(*find_parameter(kTable, name), text, &config, message);
}

}  // namespace

TEST_CASE("the compiler counts the members of a struct") {
  STATIC_REQUIRE(member_count<Inner>() == 3);
  STATIC_REQUIRE(member_count<Outer>() == 5);
  STATIC_REQUIRE(member_count<PipelineConfig>() == 9 + 7);
  STATIC_REQUIRE(kTable.size() == 5);
}

TEST_CASE("names come from the members, those of inner structs with a dot") {
  CHECK(kTable[0].name.view() == "step_m");
  CHECK(kTable[3].name.view() == "inner.count");
  CHECK(kTable[4].name.view() == "inner.exact");
  CHECK(find_parameter(kTable, "inner.exact") == &kTable[4]);
  CHECK(find_parameter(kTable, "inner") == nullptr);
  CHECK(find_parameter(kTable, "callback") == nullptr);
}

TEST_CASE("the range of what only code sets is checked, and nobody else knows it") {
  CHECK(find_parameter(kTable, "inner.rounds") == nullptr);
  CHECK(kCheckedParameters<Outer>.size() == kTable.size() + 1);
  Outer config;
  config.inner.rounds = 10;
  CHECK(std::string(refused(config)) == "inner.rounds must lie in [1, 9]");
}

TEST_CASE("bounds belong to a range or not, as it says, and NaN never does") {
  Outer config;
  for (const float good : {0.0F, 0.2F, 2.0F}) {
    config.step_m = good;
    CHECK(check_ranges(config).code == ErrorCode::kOk);
  }
  for (const float wrong : {0.1999F, 2.001F, -1.0F, std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity()}) {
    config.step_m = wrong;
    CHECK(std::string(refused(config)) == "step_m must lie in 0 or [0.2, 2] m");
  }
  config = {};
  for (const std::uint32_t wrong : {0U, 1U, 6U, 0xFFFFFFFFU}) {
    config.inner.count = wrong;
    CHECK(std::string(refused(config)) == "inner.count must lie in [2, 5] things");
  }
  config = {};
  for (const double wrong : {0.0, -1e-9, 1.0000001, std::numeric_limits<double>::quiet_NaN()}) {
    config.inner.exact = wrong;
    CHECK(std::string(refused(config)) == "inner.exact must lie in (0, 1] m");
  }
  config = {};
  config.inner.exact = 1.0;
  CHECK(check_ranges(config).code == ErrorCode::kOk);
  config.mode = static_cast<Outer::Mode>(2);
  CHECK(std::string(refused(config)) == "mode must be one of fast safe");
}

TEST_CASE("texts set values, and nothing else does") {
  Outer config;
  CHECK(set(config, "step_m", "0.25"));
  CHECK(config.step_m == 0.25F);
  CHECK(set(config, "inner.count", "5"));
  CHECK(config.inner.count == 5);
  CHECK(set(config, "inner.exact", "1e-3"));
  CHECK(config.inner.exact == 0.001);
  CHECK(set(config, "mode", "safe"));
  CHECK(config.mode == Outer::Mode::kSafe);
  CHECK(set(config, "on", "true"));
  CHECK(config.on);
  CHECK(set(config, "on", "0"));
  CHECK_FALSE(config.on);
  for (const auto& [name, text] : {std::pair{"step_m", "3"},
                                   {"step_m", "abc"},
                                   {"step_m", ""},
                                   {"step_m", "1e300"},
                                   {"inner.count", "2.5"},
                                   {"inner.count", "-2"},
                                   {"inner.count", "1e99"},
                                   {"inner.exact", "nan"},
                                   {"mode", "slow"},
                                   {"mode", "1"},
                                   {"on", "yes"},
                                   {"on", "2"}}) {
    CAPTURE(name, text);
    CHECK_FALSE(set(config, name, text));
  }
  CHECK(config.step_m == 0.25F);
  CHECK(config.inner.count == 5);
  CHECK(config.inner.exact == 0.001);
  CHECK(config.mode == Outer::Mode::kSafe);
}

TEST_CASE("a refused value is told with its range, and a long one is cut") {
  Outer config;
  ParameterMessage message;
  CHECK_FALSE(set_parameter(kTable[0], "7", &config, message));
  CHECK(message.view() == "step_m is 7 but must lie in 0 or [0.2, 2] m");
  CHECK_FALSE(set_parameter(kTable[0], std::string(1000, 'x'), &config, message));
  CHECK(message.view().ends_with("must lie in 0 or [0.2, 2] m"));
}

TEST_CASE("every value is written as the text that sets it") {
  PipelineConfig from;
  from.removal.log_odds_free = 0.7F;
  from.search_scope.sessions = SearchScope::Sessions::kOnlyOther;
  PipelineConfig to;
  for (const Parameter& parameter : kParameters<PipelineConfig>) {
    ParameterMessage message;
    CHECK(set_parameter(parameter, text_of(parameter, &from).view(), &to, message));
    CHECK(value_of(parameter, &from) == value_of(parameter, &to));
  }
}

TEST_CASE("a misspelt name is answered with the most similar one, a strange one with none") {
  const auto& table = kParameters<PipelineConfig>;
  const auto similar = [&](const char* name) {
    const Parameter* const found = similar_parameter(table, name);
    return found == nullptr ? std::string() : std::string(found->name.view());
  };
  CHECK(similar("removal.windw") == "removal.window");
  CHECK(similar("window") == "removal.window");
  CHECK(similar("loop_search.min_side_m") == "loop_search.triangles.min_side_m");
  CHECK(similar("keyframe.range_max") == "keyframe.range_max_m");
  CHECK(similar("xyzzy").empty());
  CHECK(similar("").empty());
  CHECK(similar(std::string(500, 'a').c_str()).empty());
  CHECK(unknown_parameter(table, "removal.windw").view() ==
        "removal.windw is no parameter; did you mean removal.window?");
  CHECK(unknown_parameter(table, "xyzzy").view() == "xyzzy is no parameter");
}

}  // namespace unimapper::test
