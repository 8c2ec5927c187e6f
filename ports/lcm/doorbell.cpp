#include "ports/lcm/doorbell.hpp"

#include <lcm/lcm-cpp.hpp>
#include <stdexcept>
#include <unimapper_wire/handle_t.hpp>
#include <utility>

#include "ports/lcm/address.hpp"
#include "ports/lcm/generated_codec.hpp"
#include "ports/lcm/live.hpp"

namespace unimapper::lcm_port {

namespace {

constexpr std::size_t kLongestName = 40;
/// Handles that may wait in LCM: one is as good as all.
constexpr int kHandlesWaiting = 8;

void check(const Handle& handle) {
  for (const std::string* name : {&handle.share, &handle.topic}) {
    if (name->empty() || name->size() > kLongestName) {
      throw std::invalid_argument("\"" + *name + "\" names neither a share nor a topic");
    }
  }
}

std::shared_ptr<lcm::LCM> open(const std::string& url) {
  const std::string fault = address_fault(url);
  if (!fault.empty()) throw LinkError("\"" + url + "\": " + fault);
  auto link = std::make_shared<lcm::LCM>(url);
  if (!link->good()) throw LinkError(url + ": LCM cannot be opened for handles");
  return link;
}

/// Whether the lengths of the two strings add up to the whole.
bool adds_up(wire::Bytes bytes) {
  wire::BigEndianReader in(bytes);
  in.skip(8 + 4);
  for (int i = 0; i < 2; ++i) {
    const auto length = in.get<std::uint32_t>();
    in.skip(length >= 1 && length <= kLongestName + 1 ? length : UINT64_MAX);
  }
  in.skip(4 + kChecksumBytes);
  return in.ok() && in.remaining() == 0;
}

}  // namespace

std::vector<std::uint8_t> encode(const Handle& handle) {
  check(handle);
  unimapper_wire::handle_t out;
  out.schema_version = unimapper_wire::handle_t::SCHEMA_VERSION;
  out.share = handle.share;
  out.topic = handle.topic;
  out.sequence = static_cast<std::int32_t>(handle.sequence);
  return encode_generated(out);
}

std::optional<Handle> decode_handle(wire::Bytes bytes) {
  unimapper_wire::handle_t in;
  if (!adds_up(bytes) || !decode_generated(bytes, in)) return std::nullopt;
  return Handle{std::move(in.share), std::move(in.topic), static_cast<std::uint32_t>(in.sequence)};
}

Doorbell::Doorbell(const std::string& url, const std::string& share, const std::string& topic)
    : Doorbell(open(url), share, topic) {}

Doorbell::Doorbell(std::shared_ptr<lcm::LCM> link, const std::string& share,
                   const std::string& topic)
    : link_(std::move(link)), handle_{share, topic, 0} {
  check(handle_);
}

bool Doorbell::ring(std::uint32_t sequence) {
  handle_.sequence = sequence;
  const std::vector<std::uint8_t> bytes = encode(handle_);
  return link_->publish(std::string(kHandleChannel), bytes.data(),
                        static_cast<unsigned int>(bytes.size())) == 0;
}

DoorbellListener::DoorbellListener(const std::string& url, const std::string& share,
                                   const std::string& topic)
    : DoorbellListener(open(url), share, topic) {}

DoorbellListener::DoorbellListener(std::shared_ptr<lcm::LCM> link, const std::string& share,
                                   const std::string& topic)
    : link_(std::move(link)), share_(share), topic_(topic) {
  check({share, topic, 0});
  lcm::Subscription* const subscription =
      link_->subscribe(std::string(kHandleChannel), &DoorbellListener::on_message, this);
  subscription->setQueueCapacity(kHandlesWaiting);
  subscription_ = subscription;
}

DoorbellListener::~DoorbellListener() {
  link_->unsubscribe(static_cast<lcm::Subscription*>(subscription_));
}

bool DoorbellListener::wait(std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + timeout;
  // What waits already is passed over at once: one look at the ring sees all of it.
  for (int i = 0; i < kHandlesWaiting && link_->handleTimeout(0) > 0; ++i) continue;
  while (!rung_) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    if (left <= std::chrono::milliseconds::zero()) break;
    if (link_->handleTimeout(static_cast<int>(left.count())) < 0) break;
  }
  return std::exchange(rung_, false);
}

void DoorbellListener::on_message(const lcm::ReceiveBuffer* buffer,
                                  const std::string& /*channel*/) {
  const auto handle =
      decode_handle({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  malformed_ += handle ? 0 : 1;
  rung_ = rung_ || (handle && handle->share == share_ && handle->topic == topic_);
}

}  // namespace unimapper::lcm_port
