// Tests of the envelope of authenticated messages.
#include "ports/lcm/envelope.hpp"

#include <unimapper_wire/authenticated_t.hpp>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;
using namespace unimapper::lcm_port;
using Data = std::vector<std::uint8_t>;

namespace {

const Data kMessage = {1, 2, 3, 4, 5};

Data sample() {
  Data bytes = write_envelope(
      {4000000000U, {0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL}, 77, kMessage, {}, {}});
  for (std::uint8_t i = 0; i < kCodeBytes; ++i) bytes.push_back(static_cast<std::uint8_t>(i + 1));
  return bytes;
}

}  // namespace

TEST_CASE("an envelope comes back as it went, from LCM's own decoder too") {
  const Data bytes = sample();
  CHECK(bytes.size() == kMessage.size() + kEnvelopeBytes);
  CHECK(is_envelope(bytes));
  const auto envelope = read_envelope(bytes);
  REQUIRE(envelope.has_value());
  CHECK(envelope->robot == 4000000000U);
  CHECK(envelope->boot == BootId{0x0F1E2D3C4B5A6978ULL, 0xFEDCBA9876543210ULL});
  CHECK(envelope->number == 77);
  CHECK(Data(envelope->message.begin(), envelope->message.end()) == kMessage);
  CHECK(envelope->code.size() == kCodeBytes);
  CHECK(envelope->code[0] == 1);
  CHECK(envelope->signed_bytes.size() + kCodeBytes == bytes.size());
  unimapper_wire::authenticated_t message;
  const auto size = static_cast<int>(bytes.size());
  REQUIRE(message.decode(bytes.data(), 0, size) == size);
  CHECK(message.schema_version == 1);
  CHECK(message.number == 77);
  CHECK(message.message == kMessage);
  CHECK(message.code[15] == 16);
}

TEST_CASE("an envelope of another length is none") {
  const Data bytes = sample();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (read_envelope(Bytes(bytes).first(length))) FAIL("cut to " << length);
  }
  Data longer = bytes;
  longer.push_back(0);
  CHECK_FALSE(read_envelope(longer).has_value());
  for (std::size_t at = 40; at < 44; ++at) {  // the message's length
    Data forged = bytes;
    forged[at] = 0xFF;
    CHECK_FALSE(read_envelope(forged).has_value());
  }
  CHECK_FALSE(is_envelope(encode(wire::SessionMessage{{{1, 2}, "a", "b"}, {}, 0, 0})));
}

TEST_CASE("who has no keys reads what is in an envelope") {
  const SessionInfo info{{3, {4, 5}}, "robot", "vlp-16"};
  wire::Receiver receiver;
  const Data session = encode(wire::SessionMessage{info, wire::SessionState::kRunning, 0, 0});
  Data bytes = write_envelope({3, {4, 5}, 0, session, {}, {}});
  bytes.resize(bytes.size() + kCodeBytes);
  receive(receiver, kSessionChannel, bytes);
  bytes.pop_back();
  receive(receiver, kSessionChannel, bytes);
  CHECK(receiver.counters().malformed == 1);
  const auto sessions = receiver.take_sessions();
  REQUIRE(sessions.size() == 1);
  CHECK(sessions[0].info.id == info.id);
}
