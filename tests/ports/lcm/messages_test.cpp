// Tests of the LCM encoding of messages.
#include "ports/lcm/messages.hpp"

#include <unimapper_wire/authenticated_t.hpp>
#include <unimapper_wire/chunk_t.hpp>
#include <unimapper_wire/health_t.hpp>
#include <unimapper_wire/map_pose_t.hpp>
#include <unimapper_wire/probe_t.hpp>
#include <unimapper_wire/receipt_t.hpp>
#include <unimapper_wire/session_t.hpp>
#include <unimapper_wire/stored_t.hpp>

#include "tests/ports/lcm/damage.hpp"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using lcm_test::check_only_the_original_passes;
using lcm_test::sealed;
using Data = std::vector<std::uint8_t>;

namespace {

constexpr SessionId kRobot{4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};

SessionMessage sample_session() {
  return {{kRobot, "robot_a.day-2", "os2-128"}, SessionState::kRunning, 12, 3};
}

ChunkMessage sample_chunk() { return {kRobot, 7, 1, 3, 11, 0xDEADBEEF, {1, 2, 3, 4}}; }

HealthMessage sample_health() {
  HealthMessage health;
  health.session = {1, 2};
  health.points_in = 1'000'000'000'000;
  health.stages = {{"ingest", 1.0F, 2.0F, 3.0F}, {"total", 4.0F, 5.0F, 6.0F}};
  health.drops = {{"cells_full", 77}};
  health.deadline_misses = 6;
  health.containers = {{"cells", 500, 1000}, {"voxels", 3, 4}};
  return health;
}

StoredMessage sample_stored() {
  constexpr std::uint64_t kAll = std::uint64_t{1} << 32U;
  return {kRobot,
          true,
          5,
          7,
          kAll,
          {{7, 9}, {12, kAll}},
          {{9, std::vector<bool>(8, true)},
           {10, {true, false, false, true, false, false, false, false, true}}}};
}

ProbeMessage sample_probe() {
  return {kRobot, 4000000001U, 1700000000123456789, 32000, ClockOffset{-5000000000, 1500000, 3}};
}

ReceiptMessage sample_receipt() {
  return {kRobot,    0xFFFFFFFFFFFFFFFFULL, 4000000001U, 1700000000123456789,
          150000000, 123456789012,          16000000};
}

MapPoseMessage sample_map_pose() { return lcm_test::map_pose_of(kRobot, 3, 4000000001U); }

/// The generated place in the map with one change, as a forger would send it.
std::vector<std::uint8_t> forged(const std::function<void(unimapper_wire::map_pose_t&)>& change) {
  std::vector<std::uint8_t> bytes = encode(sample_map_pose());
  unimapper_wire::map_pose_t message;
  REQUIRE(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0);
  change(message);
  bytes.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return sealed(bytes);
}

}  // namespace

TEST_CASE("messages come back as they went") {
  const auto session = decode_session(encode(sample_session()));
  REQUIRE(session.has_value());
  CHECK(session->info.id == kRobot);
  CHECK(session->info.name == "robot_a.day-2");
  CHECK(session->info.sensor == "os2-128");
  CHECK(session->state == SessionState::kRunning);
  CHECK(session->keyframes == 12);
  CHECK(session->keyframes_dropped == 3);

  const auto chunk = decode_chunk(encode(sample_chunk()));
  REQUIRE(chunk.has_value());
  CHECK(chunk->session == kRobot);
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

  const auto stored = decode_stored(encode(sample_stored()));
  REQUIRE(stored.has_value());
  CHECK(stored->session == kRobot);
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

TEST_CASE("probes and receipts arrive as they were sent") {
  const auto probe = decode_probe(encode(sample_probe()));
  REQUIRE(probe);
  CHECK(probe->session == kRobot);
  CHECK(probe->number == 4000000001U);
  CHECK(probe->robot_time_ns == 1700000000123456789);
  CHECK(probe->bytes_per_second == 32000);
  REQUIRE(probe->clock);
  CHECK(probe->clock->base_minus_robot_ns == -5000000000);
  CHECK(probe->clock->uncertainty_ns == 1500000);
  CHECK(probe->clock->steps == 3);
  CHECK_FALSE(decode_probe(encode(ProbeMessage{kRobot, 1, 0, 0, {}}))->clock);

  const auto receipt = decode_receipt(encode(sample_receipt()));
  REQUIRE(receipt);
  CHECK(receipt->session == kRobot);
  CHECK(receipt->base == 0xFFFFFFFFFFFFFFFFULL);
  CHECK(receipt->number == 4000000001U);
  CHECK(receipt->base_time_ns == 1700000000123456789);
  CHECK(receipt->held_ns == 150000000);
  CHECK(receipt->pieces == 123456789012);
  CHECK(receipt->window_bytes == 16000000);
}

TEST_CASE("a place in the map arrives as it was sent") {
  const MapPoseMessage sent = sample_map_pose();
  const auto message = decode_map_pose(encode(sent));
  REQUIRE(message);
  CHECK(message->session == kRobot);
  CHECK(message->epoch == 3);
  CHECK(message->sequence == 4000000001U);
  CHECK(message->stamp_ns == 1700000000123456789);
  CHECK(message->state == MapPoseState::kLocalised);
  CHECK(message->T_map_odometry.translation == sent.T_map_odometry.translation);
  CHECK(message->T_map_odometry.rotation.isApprox(sent.T_map_odometry.rotation, 1e-12));
  CHECK(message->covariance == sent.covariance);
  CHECK(message->loops == 4);
  CHECK(message->since_loop_m == 12.5);
  CHECK(message->reason.empty());
  CHECK(position_sigma_m(*message) == Approx(std::sqrt(0.001 + 0.007 + 0.012)));
}

TEST_CASE("why a robot is not localised arrives as far as it fits, without what cannot be shown") {
  MapPoseMessage message = sample_map_pose();
  message.state = MapPoseState::kAmbiguous;
  message.reason = "two\nplaces " + std::string(300, 'x');
  const auto arrived = decode_map_pose(encode(message));
  REQUIRE(arrived);
  CHECK(arrived->state == MapPoseState::kAmbiguous);
  CHECK(arrived->reason.find("two_places xxx") == 0);
  CHECK(arrived->reason.size() == kMaxMapPoseReasonBytes);
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

TEST_CASE("a receipt that no base sends is refused") {
  ReceiptMessage receipt = sample_receipt();
  SECTION("sent before it was asked for") { receipt.held_ns = -1; }
  SECTION("a window that holds no datagram") { receipt.window_bytes = kSmallestWindow - 1; }
  SECTION("fewer pieces than none") { receipt.pieces = 1ULL << 63U; }
  CHECK_FALSE(decode_receipt(encode(receipt)));
}

TEST_CASE("a place in the map that no base sends is refused even when its checksum fits") {
  using Wire = unimapper_wire::map_pose_t;
  CHECK(decode_map_pose(forged([](Wire&) {})));
  CHECK(decode_map_pose(forged([](Wire& m) { m.quaternion[0] += 1e-8; })));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  const std::vector<std::function<void(Wire&)>> changes = {
      [](Wire& m) { m.schema_version = 2; },
      [](Wire& m) { m.epoch = 0; },
      [](Wire& m) { m.state = 3; },
      [](Wire& m) { m.state = -1; },
      [nan](Wire& m) { m.translation[1] = nan; },
      [infinite](Wire& m) { m.translation[2] = infinite; },
      [](Wire& m) { m.translation[0] = 2e8; },
      [nan](Wire& m) { m.quaternion[3] = nan; },
      [](Wire& m) { m.quaternion[0] += 0.01; },
      [](Wire& m) { std::memset(m.quaternion, 0, sizeof m.quaternion); },
      [nan](Wire& m) { m.covariance[1] = nan; },
      [infinite](Wire& m) { m.covariance[20] = infinite; },
      [](Wire& m) { m.since_loop_m = -1.0; },
      [nan](Wire& m) { m.since_loop_m = nan; },
      [](Wire& m) { m.reason = std::string(201, 'x'); },
      [](Wire& m) { m.reason = "a\nb"; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    INFO("change " << i);
    CHECK_FALSE(decode_map_pose(forged(changes[i])));
  }
  for (const int diagonal : {0, 6, 11, 15, 18, 20}) {
    INFO("variance " << diagonal);
    CHECK_FALSE(decode_map_pose(forged([=](Wire& m) { m.covariance[diagonal] = -1e-9; })));
  }
  CHECK(decode_map_pose(forged([](Wire& m) { m.covariance[1] = -1.0; })));  // no variance
}

TEST_CASE("damaged messages are refused, wherever the damage is") {
  check_only_the_original_passes(encode(sample_session()), decode_session);
  check_only_the_original_passes(encode(sample_chunk()), decode_chunk);
  check_only_the_original_passes(encode(sample_health()), decode_health);
  check_only_the_original_passes(encode(sample_stored()), decode_stored);
  check_only_the_original_passes(encode(sample_probe()), decode_probe);
  check_only_the_original_passes(encode(sample_receipt()), decode_receipt);
  check_only_the_original_passes(encode(sample_map_pose()), decode_map_pose);
  MapPoseMessage not_yet = sample_map_pose();
  not_yet.reason = "no loop to the map yet";
  check_only_the_original_passes(encode(not_yet), decode_map_pose);
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
  CHECK(to_text(kRobot.boot) == "0f1e2d3c4b5a6978fedcba9876543210");

  SessionMessage message = sample_session();
  message.info.name = "../up";
  CHECK_THROWS_AS(encode(message), std::invalid_argument);
  // Nor is it read where the checksum fits.
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

TEST_CASE("the types of messages never change") {
  using namespace unimapper_wire;
  const auto hash = [](auto message) {
    return static_cast<std::uint64_t>(decltype(message)::getHash());
  };
  // LCM's fingerprint covers names, types and order of every field: old logs stay readable only
  // as long as those of pieces and sessions hold.
  CHECK(hash(chunk_t()) == 0xb11f22c2708aa5a8);
  CHECK(hash(session_t()) == 0xe68c718377be05d8);
  CHECK(hash(health_t()) == 0x8b42066b9d421287);
  CHECK(hash(stored_t()) == 0x01d2b8ef4d9faed2);
  CHECK(hash(probe_t()) == 0x662142ba3fbaaaa6);
  CHECK(hash(receipt_t()) == 0x2fc100bb9ddb77c8);
  CHECK(hash(map_pose_t()) == 0xb1c8130f33103ede);
  CHECK(hash(authenticated_t()) == 0x35f88e5762526fd4);
}
