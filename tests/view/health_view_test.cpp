// Tests of a robot's health over time.
#include "src/apps/view/health_view.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

using namespace unimapper;
using namespace unimapper::apps;

TEST_CASE("health has a column for each figure, with gaps where a message lacks it") {
  std::vector<store::HealthRow> history(3);
  history[0].session = 4;
  history[1].session = history[2].session = 9;
  history[1].received_s = 1000;
  history[1].details = {{"stage", "removal", {10.0, 20.0, 30.0}}, {"container", "cells", {3, 4}}};
  history[2].received_s = 1060;
  history[2].deadline_misses = 2;
  history[2].keyframes = 12;
  history[2].details = {{"stage", "removal", {11.0, 21.0, 31.0}}, {"drop", "too far away", {7}},
                        {"clock", "-2500000", {500000, 1}},       {"stored", "keyframes", {9}},
                        {"container", "spool", {2000, 8000}},     {"stage", "broken", {}}};
  const auto json = describe_health(history, 9);
  CHECK(json["time_s"].dump() == "[1000,1060]");
  CHECK(json["deadline_misses"].dump() == "[0,2]");
  CHECK(json["stage_ms"]["removal p99"].dump() == "[20.0,21.0]");
  CHECK(json["fill"]["cells"].dump() == "[0.75,null]");
  CHECK(json["dropped"]["too far away"].dump() == "[null,7.0]");
  CHECK(json["clock_offset_ms"].dump() == "[null,-2.5]");
  CHECK(json["latency_ms"].dump() == "[null,0.5]");
  CHECK(json["acknowledged"].dump() == "[null,9.0]");
  CHECK(json["missing"].dump() == "[null,3.0]");
  CHECK(json["spool_bytes"].dump() == "[null,2000.0]");
  CHECK(json["fill"]["spool"].dump() == "[null,0.25]");
  CHECK_FALSE(link_latency_ms(history[1]).has_value());
  CHECK(link_latency_ms(history[2]) == 0.5);
  CHECK(describe_health(history, 5).is_null());
}
