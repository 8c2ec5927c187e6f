// Configurations and memory that C programs hand over: right, old, new, and garbage.
#include "ports/c/config.hpp"

#include "c_pipeline.hpp"
#include "tests/test.hpp"
#include "unimapper/core/decimal.hpp"
#include "unimapper/core/parameter_table.hpp"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

std::string check(const um_config& config, um_status expected) {
  const char* message = nullptr;
  CHECK(um_config_check(&config, &message) == expected);
  CHECK(um_config_check(&config, nullptr) == expected);
  return message == nullptr ? "" : message;
}

/// um_init refuses, says why, and hands out no pipeline.
std::string refused(const um_config* config, void* memory, std::size_t bytes, um_status expected) {
  um_pipeline* pipeline = reinterpret_cast<um_pipeline*>(1);
  const char* message = nullptr;
  CHECK(um_init(config, memory, bytes, &pipeline, &message) == expected);
  CHECK(pipeline == nullptr);
  return message == nullptr ? "" : message;
}

std::string value_of(const um_config& config, const char* name) {
  char value[32];
  REQUIRE(um_config_get(&config, name, value, sizeof value) == UM_OK);
  return value;
}

}  // namespace

TEST_CASE("a name sets the C++ parameter of that name and no other") {
  const std::span<const Parameter> rows = kParameters<PipelineConfig>;
  um_config before;
  REQUIRE(um_config_init(&before, UM_SENSOR_GENERIC) == UM_OK);
  for (const Parameter& row : rows) {
    const std::string name(row.name.view());
    CAPTURE(name);
    um_config c = before;
    const double middle = 0.7 * row.range.low + 0.3 * row.range.high;
    const auto whole = static_cast<long>(middle);
    for (const std::string& text :
         {std::string("true"), std::string("false"), std::string("only_same"),
          std::string(decimal_of(static_cast<float>(middle)).view()), std::to_string(whole),
          std::to_string(whole + 1)}) {
      // Until one of them is a value of that parameter, and another than before.
      if (value_of(c, name.c_str()) != value_of(before, name.c_str())) break;
      const um_status status = um_config_set(&c, name.c_str(), text.c_str(), nullptr);
      CHECK((status == UM_OK || status == UM_INVALID_CONFIG));
    }
    PipelineConfig config;
    // Members that do not fit each other are none of this test's concern.
    (void)unimapper::c::read_config(&c, config);
    for (const Parameter& other : rows) {
      const std::string value = value_of(c, other.name.view().data());
      CHECK(value == text_of(other, &config).view());
      CHECK((value == value_of(before, other.name.view().data())) == (&other != &row));
    }
  }
}

TEST_CASE("the members of um_config are parameters of the C++ configuration") {
  um_config c;
  REQUIRE(um_config_init(&c, UM_SENSOR_GENERIC) == UM_OK);
  c.keyframe_scans = 11;
  c.keyframe_range_min_m = 1.5F;
  c.keyframe_range_max_m = 77.0F;
  c.keyframe_max_points_per_scan = 1234;
  c.voxel_max_cells = 4321;
  c.loop_search_max_places = 55;
  c.loop_search_accept_confidence = 0.5F;
  c.budget_us = 5000;
  c.clock_ns = [] { return std::int64_t{7}; };
  c.executor = {[](void*, std::uint32_t, um_part, void*) {}, &c, 3};
  PipelineConfig config;
  REQUIRE(unimapper::c::read_config(&c, config).status == UM_OK);
  CHECK(config.keyframe.scans == 11);
  CHECK(config.keyframe.range_min_m == 1.5F);
  CHECK(config.keyframe.range_max_m == 77.0F);
  CHECK(config.keyframe.max_points_per_scan == 1234);
  CHECK(config.voxel.max_cells == 4321);
  CHECK(config.loop_search.max_places == 55);
  CHECK(config.loop_search.accept_confidence == 0.5F);
  CHECK(config.budget_us == 5000);
  CHECK(config.clock_ns() == 7);
  CHECK(config.executor.run == c.executor.run);
  CHECK(config.executor.context == &c);
  CHECK(config.executor.workers == 3);

  // By name they are the same values, in both directions.
  CHECK(value_of(c, "voxel.max_cells") == "4321");
  CHECK(um_config_set(&c, "keyframe.range_max_m", "66.5", nullptr) == UM_OK);
  CHECK(um_config_set(&c, "removal.window", "5", nullptr) == UM_OK);
  CHECK(c.keyframe_range_max_m == 66.5F);
  CHECK(c.voxel_max_cells == 4321);
  CHECK(c.clock_ns != nullptr);
  CHECK(c.executor.workers == 3);
  REQUIRE(unimapper::c::read_config(&c, config).status == UM_OK);
  CHECK(config.keyframe.range_max_m == 66.5F);
  CHECK(config.removal.window == 5);
  CHECK(value_of(c, "removal.window") == "5");
}

TEST_CASE("a parameter that cannot be set is refused in words") {
  um_config c = small_c_config();
  const um_config before = c;
  const auto refused_with = [&](const char* name, const char* value, um_status status) {
    const char* message = nullptr;
    CHECK(um_config_set(&c, name, value, &message) == status);
    CHECK(um_config_set(&c, name, value, nullptr) == status);
    return std::string(message);
  };
  CHECK(refused_with("removal.windw", "10", UM_UNKNOWN_PARAMETER) ==
        "removal.windw is no parameter; did you mean removal.window?");
  CHECK(refused_with("removal.window", "99", UM_INVALID_CONFIG) ==
        "removal.window is 99 but must lie in [1, 32] keyframes");
  CHECK(refused_with("removal.window", "ten", UM_INVALID_CONFIG) ==
        "removal.window is ten but must lie in [1, 32] keyframes");
  CHECK_THAT(refused_with("removal.components", "maybe", UM_INVALID_CONFIG),
             Contains("must be true or false"));
  CHECK_THAT(refused_with(nullptr, "1", UM_NULL_ARGUMENT), Contains("null"));
  CHECK_THAT(refused_with("removal.window", nullptr, UM_NULL_ARGUMENT), Contains("null"));
  CHECK_THAT(refused_with(std::string(5000, 'x').c_str(), "1", UM_UNKNOWN_PARAMETER),
             Contains("is no parameter"));
  CHECK(value_of(c, "removal.window") == value_of(before, "removal.window"));

  char now[3];
  CHECK(um_config_get(&c, "removal.windw", now, 3) == UM_UNKNOWN_PARAMETER);
  CHECK(um_config_get(&c, "removal.window", now, 2) == UM_CAPACITY_EXCEEDED);
  CHECK(um_config_get(&c, "removal.window", now, 3) == UM_OK);
  CHECK(um_config_get(&c, "removal.window", nullptr, 3) == UM_NULL_ARGUMENT);
  CHECK(um_config_get(nullptr, "removal.window", now, 3) == UM_NULL_ARGUMENT);
  CHECK(um_config_set(nullptr, "removal.window", "3", nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("a configuration may be copied, message and all") {
  um_config c = small_c_config();
  REQUIRE(um_config_set(&c, "removal.window", "3", nullptr) == UM_OK);
  const um_config copy = c;
  REQUIRE(um_config_set(&c, "removal.window", "4", nullptr) == UM_OK);
  CHECK(value_of(copy, "removal.window") == "3");
  CHECK(um_required_bytes(&copy) < um_required_bytes(&c));
}

TEST_CASE("room for events is part of the block") {
  um_config config = small_c_config();
  const std::size_t without = um_required_bytes(&config);
  config.event_capacity = 64;
  const std::size_t with = um_required_bytes(&config);
  CHECK(with >= without + 64 * sizeof(um_event));
  CHECK(with % UM_ALIGNMENT == without % UM_ALIGNMENT);
  for (const std::uint32_t wrong : {3U, 65U, (1U << 20U) + 1U, 1U << 21U, 0xFFFFFFFFU}) {
    config.event_capacity = wrong;
    CHECK_THAT(check(config, UM_INVALID_CONFIG), Contains("event_capacity"));
    CHECK(um_required_bytes(&config) == 0);
  }
}

TEST_CASE("members out of range are refused by name") {
  const auto with = [](auto change) {
    um_config config = small_c_config();
    change(config);
    return check(config, UM_INVALID_CONFIG);
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK_THAT(with([](um_config& c) { c.keyframe_scans = 0; }), Contains("keyframe.scans"));
  CHECK_THAT(with([&](um_config& c) { c.keyframe_range_max_m = nan; }),
             Contains("keyframe.range_max_m"));
  CHECK_THAT(with([](um_config& c) { c.voxel_max_cells = 1; }), Contains("voxel.max_cells"));
  CHECK_THAT(with([](um_config& c) { c.hidden[0] ^= 1U; }), Contains("um_config_init"));
  CHECK_THAT(with([](um_config& c) { c.budget_us = 5000; }), Contains("clock"));
  CHECK_THAT(with([](um_config& c) { c.executor.workers = 2; }), Contains("executor.workers"));
  for (const std::uint32_t workers : {0U, UM_MAX_WORKERS + 1U}) {
    const auto unserved = [&](um_config& c) {
      c.executor = {[](void*, std::uint32_t, um_part, void*) {}, nullptr, workers};
    };
    CHECK_THAT(with(unserved), Contains("executor.workers"));
  }
}

TEST_CASE("garbage is refused") {
  for (const int byte : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
    um_config config;
    std::memset(static_cast<void*>(&config), byte, sizeof config);
    CHECK(um_config_check(&config, nullptr) != UM_OK);
    CHECK(um_required_bytes(&config) == 0);
  }
  CHECK(um_config_check(nullptr, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_required_bytes(nullptr) == 0);
}

TEST_CASE("memory that will not do is refused with a sentence") {
  const um_config config = small_c_config();
  const std::size_t bytes = um_required_bytes(&config);
  const MemoryBlock block(bytes + UM_ALIGNMENT);
  CHECK_THAT(refused(&config, block.data(), bytes - 1, UM_MEMORY_TOO_SMALL), Contains("smaller"));
  CHECK_THAT(refused(&config, block.data(), 0, UM_MEMORY_TOO_SMALL), Contains("smaller"));
  CHECK_THAT(refused(&config, block.data() + 1, bytes, UM_MEMORY_MISALIGNED), Contains("64-byte"));
  CHECK_THAT(refused(&config, nullptr, bytes, UM_NULL_ARGUMENT), Contains("null"));
  CHECK_THAT(refused(nullptr, block.data(), bytes, UM_NULL_ARGUMENT), Contains("null"));
  CHECK(um_init(&config, block.data(), bytes, nullptr, nullptr) == UM_NULL_ARGUMENT);

  um_pipeline* pipeline = nullptr;
  const char* message = nullptr;
  // The byte behind the block stays the caller's.
  block.data()[bytes] = std::byte{0x55};
  REQUIRE(um_init(&config, block.data(), bytes, &pipeline, &message) == UM_OK);
  CHECK(std::string(message).empty());
  CHECK(static_cast<void*>(pipeline) == block.data());
  CHECK(block.data()[bytes] == std::byte{0x55});
}
