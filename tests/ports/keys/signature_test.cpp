// Tests of signed keyframes: only what the robot signed, and only that.
#include "ports/keys/signature.hpp"

#include "src/wire/signed_keyframe.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::keys;
using Data = std::vector<std::uint8_t>;

namespace {

Data keyframe() { return wire::encode_keyframe(wire::wire_test::keyframe_of({7, {1, 2}}, 3, 20)); }

Data signed_by(const RobotKey& key) {
  Data bytes = keyframe();
  KeyframeSigner(key).sign(bytes);
  return bytes;
}

}  // namespace

TEST_CASE("a keyframe is known to be of the robot that signed it") {
  const RobotKey robot = new_robot_key("robot");
  const RobotKey other = new_robot_key("other");
  const Data bytes = signed_by(robot);
  CHECK(is_signed_by(base_key_of(robot).verifying, bytes));
  CHECK_FALSE(is_signed_by(base_key_of(other).verifying, bytes));
  CHECK_FALSE(is_signed_by(base_key_of(robot).verifying, keyframe()));
  CHECK_FALSE(is_signed_by(base_key_of(robot).verifying, {}));
}

TEST_CASE("a signed keyframe is read as the one without") {
  const Data plain = keyframe();
  const Data bytes = signed_by(new_robot_key("robot"));
  CHECK(bytes.size() == plain.size() + 68);
  const wire::SignedKeyframe parts = wire::split_signature(bytes);
  CHECK(Data(parts.keyframe.begin(), parts.keyframe.end()) == plain);
  CHECK(parts.signature.size() == wire::kSignatureBytes);
  CHECK(wire::split_signature(plain).signature.empty());
  const auto decoded = wire::decode_keyframe(bytes);
  REQUIRE(decoded.record.has_value());
  CHECK(wire::encode_keyframe(*decoded.record) == plain);
}

TEST_CASE("a keyframe that was changed anywhere is signed by nobody") {
  const RobotKey robot = new_robot_key("robot");
  const VerifyingKey key = base_key_of(robot).verifying;
  const Data bytes = signed_by(robot);
  for (std::size_t at = 0; at < bytes.size(); at += at + 80 < bytes.size() ? 37 : 1) {
    const Data changed = lcm_port::lcm_test::with_flipped(bytes, 8 * at + at % 8);
    if (is_signed_by(key, changed)) FAIL("byte " << at);
  }
  for (std::size_t length = 0; length < bytes.size(); length += 29) {
    if (is_signed_by(key, wire::Bytes(bytes).first(length))) FAIL("cut to " << length);
  }
}

TEST_CASE("a keyframe is signed once, with the same signature each time") {
  const RobotKey robot = new_robot_key("robot");
  Data bytes = signed_by(robot);
  CHECK(signed_by(robot) == bytes);
  CHECK_THROWS_AS(KeyframeSigner(robot).sign(bytes), std::invalid_argument);
}
