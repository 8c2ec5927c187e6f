// Tests of the LCM encoding of a robot's place in the base's map.
#include <catch2/catch.hpp>
#include <cstring>
#include <functional>
#include <limits>
#include <unimapper_wire/map_pose_t.hpp>

#include "ports/lcm/messages.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/ports/lcm/map_pose.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;
using lcm_test::check_only_the_original_passes;
using lcm_test::map_pose_of;
using lcm_test::sealed;

namespace {

const SessionId kAlpha{4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}};

MapPoseMessage sample() { return map_pose_of(kAlpha, 3, 4000000001U); }

/// The generated message with one change, as a forger would send it.
std::vector<std::uint8_t> forged(const std::function<void(unimapper_wire::map_pose_t&)>& change) {
  std::vector<std::uint8_t> bytes = encode(sample());
  unimapper_wire::map_pose_t message;
  REQUIRE(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0);
  change(message);
  bytes.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return sealed(bytes);
}

}  // namespace

TEST_CASE("a place in the map arrives as it was sent") {
  const auto message = decode_map_pose(encode(sample()));
  REQUIRE(message);
  CHECK(message->session == kAlpha);
  CHECK(message->epoch == 3);
  CHECK(message->sequence == 4000000001U);
  CHECK(message->stamp_ns == 1700000000123456789);
  CHECK(message->state == MapPoseState::kLocalised);
  CHECK(message->T_map_odometry.translation == sample().T_map_odometry.translation);
  CHECK(message->T_map_odometry.rotation.isApprox(sample().T_map_odometry.rotation, 1e-12));
  CHECK(message->covariance == sample().covariance);
  CHECK(message->loops == 4);
  CHECK(message->since_loop_m == 12.5);
  CHECK(message->reason.empty());
  CHECK(position_sigma_m(*message) == Approx(std::sqrt(0.001 + 0.007 + 0.012)));
}

TEST_CASE("why a robot is not localised arrives as far as it fits, without what cannot be shown") {
  MapPoseMessage message = sample();
  message.state = MapPoseState::kAmbiguous;
  message.reason = "two\nplaces " + std::string(300, 'x');
  const auto arrived = decode_map_pose(encode(message));
  REQUIRE(arrived);
  CHECK(arrived->state == MapPoseState::kAmbiguous);
  CHECK(arrived->reason.find("two_places xxx") == 0);
  CHECK(arrived->reason.size() == kMaxMapPoseReasonBytes);
}

TEST_CASE("a damaged place in the map is refused, wherever the damage is") {
  check_only_the_original_passes(encode(sample()), decode_map_pose);
  MapPoseMessage message = sample();
  message.reason = "no loop to the map yet";
  check_only_the_original_passes(encode(message), decode_map_pose);
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

TEST_CASE("the type of a place in the map is known") {
  CHECK(unimapper_wire::map_pose_t::getHash() == static_cast<std::int64_t>(0xb1c8130f33103edeULL));
}
