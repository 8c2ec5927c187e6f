// Fuzz target of what reaches a centre from its sites: subjects have one text each, a message is
// answered at most once, "stored" only if it is, and what another robot sends is taken all the
// same.
#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/nats/deliveries.hpp"
#include "ports/nats/subjects.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/receiver.hpp"

namespace {

using namespace unimapper;
using fuzz::require;
using Bytes = std::vector<std::uint8_t>;

/// Stores what it is given when it is told to.
class Storage final : public wire::KeyframeStorage {
 public:
  Taken keep(wire::ReceivedKeyframe&& keyframe) override {
    const wire::KeyframeName name{keyframe.record.session, keyframe.record.sequence};
    require(!stored.contains(name));
    waiting_.keyframes.push_back(name);
    return Taken::kWaiting;
  }
  void keep(wire::ReceivedSummary&& /*summary*/) override {}
  void remove_summary(const wire::KeyframeName& /*name*/) override {}
  void keep(const wire::SessionSummary& summary) override { waiting_.sessions.push_back(summary); }
  void keep(const wire::HealthMessage& /*health*/) override {}
  wire::Committed commit_due(std::int64_t /*now_ns*/) override { return {}; }
  wire::Committed commit_all(std::int64_t /*now_ns*/) override {
    stored.insert(waiting_.keyframes.begin(), waiting_.keyframes.end());
    return std::exchange(waiting_, {});
  }
  std::optional<wire::StoredSession> find(const SessionId& id) override {
    wire::StoredSession found;
    found.summary.id = id;
    for (const wire::KeyframeName& name : stored) {
      if (name.session == id) found.keyframes.insert(name.sequence);
    }
    return found;
  }
  [[nodiscard]] std::vector<wire::RobotUsage> usage() const override { return {}; }
  [[nodiscard]] bool accepts() const override { return true; }
  [[nodiscard]] bool is_durable() const override { return true; }

  std::set<wire::KeyframeName> stored;

 private:
  wire::Committed waiting_;
};

/// Messages by the number of their delivery, and what was answered.
class Source final : public nats_port::DeliverySource {
 public:
  explicit Source(const Storage& storage) : storage_(storage) {}

  void add(std::string subject, Bytes bytes, std::uint64_t number) {
    const std::string reply = std::to_string(subjects_.size());
    subjects_.push_back(subject);
    coming_.push_back({std::move(subject), reply, number, std::move(bytes)});
  }
  std::deque<nats_port::Delivery> take() override { return std::exchange(coming_, {}); }
  void answer(const std::string& reply, const std::string& text) override {
    require(answers_.emplace(reply, text).second);
    const auto subject = nats_port::parse_subject(subjects_.at(std::stoul(reply)));
    require(subject || text == "+TERM");
    if (text == "+ACK" && subject->sequence) {
      require(storage_.stored.contains({subject->session, *subject->sequence}));
    }
  }
  [[nodiscard]] std::uint64_t failures() const override { return 0; }

  /// What was answered to the message that was added last.
  [[nodiscard]] std::string last_answer() const {
    const auto found = answers_.find(std::to_string(subjects_.size() - 1));
    return found == answers_.end() ? "" : found->second;
  }

 private:
  const Storage& storage_;
  std::vector<std::string> subjects_;
  std::deque<nats_port::Delivery> coming_;
  std::map<std::string, std::string> answers_;
};

const SessionId kVictim{7, {0x1122334455667788, 0x99AABBCCDDEEFF00}};

/// A keyframe of a few bytes.
Bytes keyframe_of(const SessionId& session, std::uint32_t sequence) {
  KeyframeRecord record;
  record.session = session;
  record.sequence = sequence;
  record.scans.resize(1);
  return wire::encode_keyframe(record);
}

/// The input, piece by piece.
class Reader {
 public:
  Reader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  [[nodiscard]] bool is_empty() const { return size_ == 0; }
  std::uint8_t byte() {
    if (size_ == 0) return 0;
    --size_;
    return *data_++;
  }
  /// As many bytes as the next one says, or as there are.
  Bytes bytes() {
    const std::size_t count = std::min<std::size_t>(byte(), size_);
    const Bytes taken(data_, data_ + count);
    data_ += count;
    size_ -= count;
    return taken;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

/// A message: its subject as text or made of two numbers, and its bytes as they are or as they
/// should be.
void add_message(Reader& in, Source& source) {
  const std::uint8_t kind = in.byte();
  const std::uint8_t number = in.byte();
  const SessionId session{number % 3U, {number / 3U % 2U, 1}};
  const std::optional<std::uint32_t> sequence =
      (kind & 1U) != 0 ? std::optional<std::uint32_t>(in.byte() % 4U) : std::nullopt;
  const Bytes text = in.bytes();
  const std::string subject = (kind & 2U) != 0
                                  ? nats_port::to_text({"north", session, sequence})
                                  : std::string(fuzz::text_of(text.data(), text.size()));
  Bytes bytes = in.bytes();
  if ((kind & 4U) != 0) {
    const auto state = (kind & 8U) != 0 ? wire::SessionState::kEnded : wire::SessionState::kRunning;
    bytes = sequence ? keyframe_of(session, *sequence)
                     : lcm_port::encode({{session, "robot", "vlp-16"}, state, number, 0});
  }
  source.add(subject, std::move(bytes), in.byte());
}

void check_subject(const std::string& text) {
  const auto subject = nats_port::parse_subject(text);
  require(!subject ||
          (nats_port::to_text(*subject) == text && nats_port::is_site_name(subject->site) &&
           text.find_first_of("*> \r\n\t") == std::string::npos));
}

/// What is not a NATS error ends the fuzzer, and so does a password that is shown.
void check_address(const std::string& text) {
  nats_port::Server server;
  server.url = text;
  fuzz::allow_refusal<nats_port::NatsError>([&server] { check(server); });
  server.url = "tls://user:pa55word@" + text;
  if (text.find("pa55word") == std::string::npos) {
    require(shown(server).find("pa55word") == std::string::npos);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(fuzz::text_of(data, size));
  check_subject(text);
  check_address(text);
  Storage storage;
  auto made = std::make_unique<Source>(storage);
  Source& source = *made;
  const auto downlink = nats_port::make_downlink(
      std::move(made), 4096, [](const std::string&) {}, storage);
  wire::ReceiverLimits limits;
  limits.max_sessions = 7;  // six that messages are about, and the other robot's
  wire::Receiver receiver(limits, *downlink);
  std::int64_t now_ns = 0;
  const auto advance = [&] {
    downlink->take(receiver);
    receiver.advance(now_ns += 100'000'000);
  };
  Reader in(data, size);
  for (int messages = 0; !in.is_empty() && messages < 32; ++messages) {
    add_message(in, source);
    if (messages % 4 == 3) advance();
    if (messages % 8 == 7) receiver.store_all();
  }
  advance();
  receiver.store_all();
  source.add(nats_port::to_text({"south", kVictim, 0}), keyframe_of(kVictim, 0), 1);
  advance();
  receiver.store_all();
  require(source.last_answer() == "+ACK");
  const nats_port::DownlinkCounters counters = downlink->counters();
  require(counters.stored + counters.postponed + counters.dropped <= counters.messages);
  return 0;
}
