// Tests of the codes of datagrams: every start, end and channel has its own.
#include "ports/keys/datagram_code.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::keys;

namespace {

constexpr BootId kBoot{0x0102030405060708ULL, 0x1112131415161718ULL};
const std::vector<std::uint8_t> kDatagram = {1, 2, 3};

LinkSecret secret(std::uint8_t first) {
  LinkSecret bytes;
  for (std::size_t i = 0; i < LinkSecret::size(); ++i) {
    bytes.data()[i] = static_cast<std::uint8_t>(first + i);
  }
  return bytes;
}

}  // namespace

TEST_CASE("a code is of one secret, end, start, channel and datagram") {
  std::set<Code> codes;
  const auto add = [&codes](const LinkSecret& key, End end, const BootId& boot,
                            std::string_view channel, const std::vector<std::uint8_t>& datagram) {
    codes.insert(DatagramCoder(key, end, boot).code(channel, datagram));
  };
  add(secret(0), End::kRobot, kBoot, "A", kDatagram);
  add(secret(0), End::kRobot, kBoot, "A", kDatagram);
  CHECK(codes.size() == 1);
  add(secret(1), End::kRobot, kBoot, "A", kDatagram);
  add(secret(0), End::kBase, kBoot, "A", kDatagram);
  add(secret(0), End::kRobot, {kBoot.high + 1, kBoot.low}, "A", kDatagram);
  add(secret(0), End::kRobot, {kBoot.high, kBoot.low + 1}, "A", kDatagram);
  add(secret(0), End::kRobot, {kBoot.low, kBoot.high}, "A", kDatagram);
  add(secret(0), End::kRobot, kBoot, "B", kDatagram);
  add(secret(0), End::kRobot, kBoot, "A\x01", {2, 3});
  add(secret(0), End::kRobot, kBoot, "A", {1, 2, 4});
  CHECK(codes.size() == 9);
}

TEST_CASE("only the whole code is the code") {
  const DatagramCoder coder(secret(0), End::kRobot, kBoot);
  const Code code = coder.code("A", kDatagram);
  CHECK(coder.is_code("A", kDatagram, code));
  for (std::size_t bit = 0; bit < 8 * code.size(); ++bit) {
    Code other = code;
    other[bit / 8] = static_cast<std::uint8_t>(other[bit / 8] ^ 1U << bit % 8);
    if (coder.is_code("A", kDatagram, other)) FAIL("bit " << bit);
  }
  for (std::size_t length = 0; length < code.size(); ++length) {
    if (coder.is_code("A", kDatagram, wire::Bytes(code).first(length))) FAIL("cut to " << length);
  }
}

TEST_CASE("codes never change: robots and bases of two versions understand each other") {
  const Code code =
      DatagramCoder(secret(0), End::kRobot, kBoot).code("UNIMAPPER_SESSION", kDatagram);
  std::string text;
  for (const std::uint8_t byte : code) {
    text += "0123456789abcdef"[byte >> 4U];
    text += "0123456789abcdef"[byte & 15U];
  }
  // As Python's hashlib computes it from docs/wire-format.md.
  CHECK(text == "fc22fdc22a19128f9982c628ee3fd882");
}
