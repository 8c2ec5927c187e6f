// Tests of the LCM encoding of messages.
#include "ports/lcm/messages.hpp"

#include <catch2/catch.hpp>
#include <unimapper_wire/chunk_t.hpp>
#include <unimapper_wire/health_t.hpp>
#include <unimapper_wire/session_t.hpp>
#include <unimapper_wire/stored_t.hpp>

#include "tests/ports/lcm/damage.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using lcm_test::check_only_the_original_passes;
using lcm_test::sealed;
using Data = std::vector<std::uint8_t>;

namespace {

SessionMessage sample_session() {
  SessionMessage message;
  message.info = {
      {4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}}, "robot_a.day-2", "os2-128"};
  message.state = SessionState::kRunning;
  message.keyframes = 12;
  message.keyframes_dropped = 3;
  return message;
}

ChunkMessage sample_chunk() {
  ChunkMessage chunk;
  chunk.session = {4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};
  chunk.sequence = 7;
  chunk.index = 1;
  chunk.count = 3;
  chunk.total_bytes = 11;
  chunk.payload_crc32 = 0xDEADBEEF;
  chunk.data = {1, 2, 3, 4};
  return chunk;
}

HealthMessage sample_health() {
  HealthMessage health;
  health.session = {1, 2};
  health.scans = 100;
  health.keyframes = 10;
  health.points_in = 1'000'000'000'000;
  health.bytes_sent = 5;
  health.stages = {{"ingest", 1.0F, 2.0F, 3.0F}, {"total", 4.0F, 5.0F, 6.0F}};
  health.drops = {{"cells_full", 77}};
  health.deadline_misses = 6;
  health.containers = {{"cells", 500, 1000}, {"voxels", 3, 4}};
  return health;
}

StoredMessage sample_stored() {
  StoredMessage stored;
  stored.session = {4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};
  stored.ended = true;
  stored.below = 5;
  stored.first = 7;
  stored.until = std::uint64_t{1} << 32U;
  stored.ranges = {{7, 9}, {12, std::uint64_t{1} << 32U}};
  stored.incomplete = {{9, std::vector<bool>(8, true)},
                       {10, {true, false, false, true, false, false, false, false, true}}};
  return stored;
}

}  // namespace

TEST_CASE("messages come back as they went") {
  const auto session = decode_session(encode(sample_session()));
  REQUIRE(session.has_value());
  CHECK(session->info.id == sample_session().info.id);
  CHECK(session->info.name == "robot_a.day-2");
  CHECK(session->info.sensor == "os2-128");
  CHECK(session->state == SessionState::kRunning);
  CHECK(session->keyframes == 12);
  CHECK(session->keyframes_dropped == 3);

  const auto chunk = decode_chunk(encode(sample_chunk()));
  REQUIRE(chunk.has_value());
  CHECK(chunk->session == sample_chunk().session);
  CHECK(chunk->sequence == 7);
  CHECK(chunk->index == 1);
  CHECK(chunk->count == 3);
  CHECK(chunk->total_bytes == 11);
  CHECK(chunk->payload_crc32 == 0xDEADBEEF);
  CHECK(chunk->data == Data{1, 2, 3, 4});

  const auto health = decode_health(encode(sample_health()));
  REQUIRE(health.has_value());
  CHECK(health->points_in == 1'000'000'000'000);
  REQUIRE(health->stages.size() == 2);
  CHECK(health->stages[1].name == "total");
  CHECK(health->stages[1].max_ms == 6.0F);
  REQUIRE(health->drops.size() == 1);
  CHECK(health->drops[0].cause == "cells_full");
  CHECK(health->drops[0].count == 77);
  CHECK(health->deadline_misses == 6);
  REQUIRE(health->containers.size() == 2);
  CHECK(health->containers[0].name == "cells");
  CHECK(health->containers[0].used == 500);
  CHECK(health->containers[1].capacity == 4);
}

TEST_CASE("what a base says it has stored comes back as it went") {
  const auto stored = decode_stored(encode(sample_stored()));
  REQUIRE(stored.has_value());
  CHECK(stored->session == sample_stored().session);
  CHECK(stored->ended);
  CHECK(stored->below == 5);
  CHECK(stored->first == 7);
  CHECK(stored->until == std::uint64_t{1} << 32U);
  REQUIRE(stored->ranges.size() == 2);
  CHECK(stored->ranges[1].begin == 12);
  CHECK(stored->ranges[1].end == std::uint64_t{1} << 32U);
  REQUIRE(stored->incomplete.size() == 2);
  CHECK(stored->incomplete[1].sequence == 10);
  CHECK(stored->incomplete[0].missing == sample_stored().incomplete[0].missing);
  CHECK(stored->incomplete[1].missing == sample_stored().incomplete[1].missing);
}

TEST_CASE("what no base can have stored is refused") {
  StoredMessage stored = sample_stored();
  SECTION("runs that overlap") { stored.ranges[1].begin = 8; }
  SECTION("a run before the first number") { stored.ranges[0].begin = 6; }
  SECTION("an empty run") { stored.ranges[0].end = 7; }
  SECTION("a run beyond the last number") { stored.until = 100; }
  SECTION("more than all numbers") { stored.until = (std::uint64_t{1} << 32U) + 1; }
  SECTION("a start before what is stored") { stored.below = 8; }
  SECTION("a keyframe without pieces") { stored.incomplete[0].missing.clear(); }
  SECTION("too many runs") {
    stored.ranges.clear();
    for (std::uint64_t i = 0; i <= kMaxStoredRanges; ++i) {
      stored.ranges.push_back({10 + 2 * i, 11 + 2 * i});
    }
  }
  CHECK_FALSE(decode_stored(encode(stored)));
}

TEST_CASE("damaged messages are refused, wherever the damage is") {
  check_only_the_original_passes(encode(sample_session()), decode_session);
  check_only_the_original_passes(encode(sample_chunk()), decode_chunk);
  check_only_the_original_passes(encode(sample_health()), decode_health);
  check_only_the_original_passes(encode(sample_stored()), decode_stored);
}

TEST_CASE("lengths that a forger made up allocate nothing") {
  // The length of the chunk's data, of the session's name, of the list of stages.
  const auto forged = [](Data bytes, std::size_t at) {
    for (std::uint32_t length : {0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFFU, 0U, 1000000U}) {
      for (std::size_t i = 0; i < 4; ++i) {
        bytes[at + i] = static_cast<std::uint8_t>(length >> (24U - 8U * i));
      }
      const Data message = sealed(bytes);
      if (decode_chunk(message) || decode_session(message) || decode_health(message) ||
          decode_stored(message)) {
        FAIL("length " << length << " at " << at);
      }
    }
  };
  forged(encode(sample_chunk()), 8 + 4 + 4 + 16 + 5 * 4);
  forged(encode(sample_session()), 8 + 4 + 4 + 16);
  forged(encode(sample_health()), 8 + 4 + 4 + 16 + 5 * 8);
  const std::size_t ranges_at = 8 + 4 + 4 + 16 + 1 + 3 * 8;
  const std::size_t incomplete_at = ranges_at + 4 + 2 * 2 * 8;
  forged(encode(sample_stored()), ranges_at);
  forged(encode(sample_stored()), incomplete_at);
  forged(encode(sample_stored()), incomplete_at + 4 + 2 * 4);  // pieces of the first keyframe
  forged(encode(sample_stored()), incomplete_at + 4 + 2 * 2 * 4);
}

TEST_CASE("pieces that cannot be parts of one whole are refused") {
  const auto passes = [](const std::function<void(ChunkMessage&)>& change) {
    ChunkMessage chunk = sample_chunk();
    change(chunk);
    return decode_chunk(encode(chunk)).has_value();
  };
  CHECK(passes([](auto&) {}));
  CHECK(passes([](auto& c) { c.total_bytes = 12; }));
  CHECK(passes([](auto& c) { c.index = 2, c.data.resize(3); }));
  CHECK(passes([](auto& c) { c.index = 0, c.count = 1, c.total_bytes = 4; }));
  CHECK_FALSE(passes([](auto& c) { c.index = 3; }));
  CHECK_FALSE(passes([](auto& c) { c.count = 0; }));
  CHECK_FALSE(passes([](auto& c) { c.data.clear(); }));
  CHECK_FALSE(passes([](auto& c) { c.total_bytes = 8; }));
  CHECK_FALSE(passes([](auto& c) { c.total_bytes = 13; }));
  CHECK_FALSE(passes([](auto& c) { c.count = 0xFFFFFFFF; }));
  CHECK_FALSE(passes([](auto& c) { c.index = 2, c.data.resize(2); }));
  CHECK_FALSE(passes([](auto& c) { c.index = 0, c.count = 1; }));
}

TEST_CASE("a session's name is safe as a file name") {
  for (const char* name : {"a", "kitti_0005", "robot-1.day2", "A"}) CHECK(is_session_name(name));
  for (const char* name : {"", ".", "..", ".hidden", "a/b", "a b", "a\nb", "\xC3\xBC"}) {
    CHECK_FALSE(is_session_name(name));
    CHECK(is_session_name(to_session_name(name)));
  }
  CHECK_FALSE(is_session_name(std::string(65, 'a')));
  CHECK(to_session_name("../etc/passwd") == "_._etc_passwd");

  SessionMessage message = sample_session();
  message.info.name = "../up";
  CHECK_THROWS_AS(encode(message), std::invalid_argument);
}

TEST_CASE("a name that is no file name is refused even when its checksum fits") {
  Data bytes = encode(sample_session());
  bytes[8 + 4 + 4 + 16 + 4] = '/';
  CHECK_FALSE(decode_session(sealed(bytes)).has_value());
}

TEST_CASE("LCM's own decoders read our messages") {
  const Data bytes = encode(sample_chunk());
  unimapper_wire::chunk_t chunk;
  REQUIRE(chunk.decode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
          static_cast<int>(bytes.size()));
  CHECK(chunk.schema_version == 2);
  CHECK(chunk.data == Data{1, 2, 3, 4});
  unimapper_wire::session_t session;
  CHECK(session.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0);
}

TEST_CASE("boots that differ in either half are two") {
  const SessionId id = sample_session().info.id;
  for (const BootId& boot :
       {BootId{id.boot.high ^ 1U, id.boot.low}, BootId{id.boot.high, id.boot.low ^ 1U}}) {
    SessionMessage other = sample_session();
    other.info.id.boot = boot;
    CHECK(decode_session(encode(other))->info.id == SessionId{id.robot, boot});
    CHECK(other.info.id != id);
  }
  CHECK(to_text(id.boot) == "0f1e2d3c4b5a6978fedcba9876543210");
}

TEST_CASE("the types of stored messages never change") {
  // LCM's fingerprint covers names, types and order of every field: old logs stay readable only
  // as long as these hold.
  CHECK(unimapper_wire::chunk_t::getHash() == static_cast<std::int64_t>(0xb11f22c2708aa5a8));
  CHECK(unimapper_wire::session_t::getHash() == static_cast<std::int64_t>(0xe68c718377be05d8));
  // Schemas 3 and 2; neither is ever stored.
  CHECK(unimapper_wire::health_t::getHash() == static_cast<std::int64_t>(0x8b42066b9d421287));
  CHECK(unimapper_wire::stored_t::getHash() == 0x01d2b8ef4d9faed2);
}
