#include "ports/lcm/live.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include "ports/lcm/address.hpp"
#include "ports/lcm/arrival.hpp"
#include "ports/lcm/receiving_thread.hpp"

namespace unimapper::lcm_port {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kReceiveBufferBytes = 4U << 20U;
constexpr std::chrono::milliseconds kPollInterval{100};
constexpr std::chrono::milliseconds kProgressInterval{1000};
constexpr std::chrono::milliseconds kAnswerInterval{200};

/// What may wait while keyframes are decoded, and is announced to the robots as their window.
constexpr std::size_t kQueueBytes = 16U << 20U;

bool is_udp(const std::string& url) { return url.rfind("udpm:", 0) == 0; }

std::unique_ptr<lcm::LCM> open_lcm(const std::string& url) {
  const std::string fault = address_fault(url);
  if (!fault.empty()) throw LinkError("\"" + url + "\": " + fault);
  auto link = std::make_unique<lcm::LCM>(url);
  if (!link->good()) {
    throw LinkError(url + ": LCM cannot be opened" +
                    (is_udp(url) ? " (a multicast route is needed, e.g. "
                                   "\"ip route add 224.0.0.0/4 dev lo\" for this machine only)"
                                 : ": can that file be read and written?"));
  }
  return link;
}

/// Value of the option in a URL's query, if it is there.
std::optional<std::uint64_t> url_option(const std::string& url, const std::string& key) {
  const std::size_t at = url.find(key + "=");
  if (at == std::string::npos) return std::nullopt;
  return std::strtoull(url.c_str() + at + key.size() + 1, nullptr, 10);
}

/// The kernel cuts larger requests silently.
std::optional<std::uint64_t> kernel_receive_limit() {
  std::uint64_t bytes = 0;
  std::ifstream file("/proc/sys/net/core/rmem_max");
  return file >> bytes ? std::optional(bytes) : std::nullopt;
}

std::string buffer_warning(const std::string& url) {
  const auto wanted = url_option(url, "recv_buf_size");
  const auto limit = kernel_receive_limit();
  if (!is_udp(url) || !wanted || !limit || *limit >= *wanted) return {};
  return "the kernel limits receive buffers to " + std::to_string(*limit) + " bytes, " +
         std::to_string(*wanted) +
         " were asked for; keyframes may be lost (sysctl net.core.rmem_max)";
}

/// A moment that the receiver was told.
Clock::time_point time_of(std::int64_t steady_ns) {
  return Clock::time_point(std::chrono::nanoseconds(steady_ns));
}

/// What the messages so far mean for going on.
class Watch {
 public:
  explicit Watch(const ListenOptions& options) : options_(options) {}

  /// Whether listening is over.
  bool is_over(const std::vector<wire::SessionProgress>& sessions, Clock::time_point now) {
    if (options_.stop && options_.stop()) return true;
    if (options_.sessions_expected == 0) return false;
    // Anybody can say that a session has ended, as often as he likes; a robot says once a second
    // that it has not.
    const auto counts = [this, now](const wire::SessionProgress& session) {
      const std::chrono::nanoseconds quiet = now - time_of(session.quiet_since_ns);
      return session.ended && session.received > 0 && quiet >= options_.end_silence;
    };
    const auto ended = std::count_if(sessions.begin(), sessions.end(), counts);
    if (static_cast<std::size_t>(ended) < options_.sessions_expected) {
      grace_ends_ = Clock::time_point::max();
      return false;
    }
    const bool whole = std::all_of(sessions.begin(), sessions.end(), [](const auto& session) {
      return !session.ended || session.received == 0 || session.whole;
    });
    grace_ends_ = std::min(grace_ends_, now + options_.grace);
    return whole || now >= grace_ends_;
  }

 private:
  const ListenOptions& options_;
  Clock::time_point grace_ends_ = Clock::time_point::max();
};

/// Where LCM delivers.
struct Inlet {
  Receiver& receiver;
  DatagramGuard* guard = nullptr;

  void take(const InboundMessage& inbound) {
    Bytes message = inbound.data;
    if (guard != nullptr) {
      const auto opened = guard->open(inbound.channel, message);
      if (!opened) return;
      message = *opened;
    }
    const auto probe =
        inbound.channel == kProbeChannel ? decode_probe(message) : std::optional<ProbeMessage>();
    if (probe) return receiver.receive(*probe, inbound.arrival);
    receive(receiver, inbound.channel, message);
  }
};

template <typename Message>
void publish_all(lcm::LCM& link, DatagramGuard* guard, std::string_view channel_name,
                 const std::vector<Message>& messages) {
  const std::string channel(channel_name);
  for (const Message& message : messages) {
    std::vector<std::uint8_t> bytes = encode(message);
    if (guard != nullptr) {
      auto sealed = guard->seal(channel, bytes);
      if (!sealed) continue;
      bytes = std::move(*sealed);
    }
    // What is lost is said again.
    (void)link.publish(channel, bytes.data(), static_cast<unsigned int>(bytes.size()));
  }
}

/// A robot's end of the network.
class Answers {
 public:
  Answers(std::unique_ptr<lcm::LCM> link, std::shared_ptr<DatagramGuard> guard)
      : link_(std::move(link)), guard_(std::move(guard)) {
    link_->subscribe(std::string(kStoredChannel), &Answers::on_message, this);
    link_->subscribe(std::string(kReceiptChannel), &Answers::on_message, this);
    link_->subscribe(std::string(kMapPoseChannel), &Answers::on_message, this);
  }

  bool publish(const std::string& channel, Bytes message) {
    if (guard_ == nullptr) return put(channel, message);
    const auto sealed = guard_->seal(channel, message);
    return sealed && put(channel, *sealed);
  }
  bool put(const std::string& channel, Bytes message) {
    return link_->publish(channel, message.data(), static_cast<unsigned int>(message.size())) == 0;
  }

  std::vector<StoredMessage> take() {
    handle();
    return std::exchange(messages_, {});
  }

  std::vector<ReceivedReceipt> take_receipts() {
    handle();
    return std::exchange(receipts_, {});
  }

  std::vector<ReceivedMapPose> take_map_poses() {
    handle();
    return std::exchange(map_poses_, {});
  }

 private:
  static constexpr int kMaxAnswers = 30;
  /// Whoever takes only one kind leaves the other behind.
  static constexpr std::size_t kMaxKept = 1024;

  /// As many as LCM queues: an endless stream of them must not keep the robot from sending.
  void handle() {
    for (int i = 0; i < kMaxAnswers && link_->handleTimeout(0) > 0; ++i) continue;
  }

  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    Bytes bytes{static_cast<const std::uint8_t*>(buffer->data), buffer->data_size};
    if (guard_ != nullptr) {
      const auto opened = guard_->open(channel, bytes);
      if (!opened) return;
      bytes = *opened;
    }
    if (channel == kReceiptChannel) return take_receipt(bytes, buffer->recv_utime);
    if (channel == kMapPoseChannel) {
      if (map_poses_.size() < kMaxKept) map_poses_.push_back(decode_map_pose(bytes));
      return;
    }
    auto message = decode_stored(bytes);
    if (message && messages_.size() < kMaxKept) messages_.push_back(std::move(*message));
  }
  void take_receipt(Bytes bytes, std::int64_t unix_us) {
    const auto message = decode_receipt(bytes);
    if (!message || receipts_.size() >= kMaxKept) return;
    const std::chrono::nanoseconds arrival(arrival_of(unix_us).steady_ns);
    receipts_.push_back({*message, Clock::time_point(arrival)});
  }

  std::unique_ptr<lcm::LCM> link_;
  std::shared_ptr<DatagramGuard> guard_;
  std::vector<StoredMessage> messages_;
  std::vector<ReceivedReceipt> receipts_;
  std::vector<ReceivedMapPose> map_poses_;
};

/// Hands over what arrives during `duration`.
void handle_for(InboundQueue& queue, Inlet& inlet, std::chrono::milliseconds duration) {
  const Clock::time_point end = Clock::now() + duration;
  do {
    const auto message = queue.pop(end);
    if (message) inlet.take(*message);
    if (!message && queue.is_over()) throw LinkError("LCM stopped delivering messages");
  } while (Clock::now() < end);
}

/// How many messages did not fit into the queue since the warning before, in words.
std::string overflow_warning(std::uint64_t dropped, std::uint64_t& told) {
  if (dropped == told) return {};
  const std::uint64_t more = dropped - std::exchange(told, dropped);
  return std::to_string(more) + " datagrams came faster than they could be taken and were dropped";
}

std::uint64_t random_number() {
  std::random_device device;
  return std::uint64_t{device()} << 32U | device();
}

}  // namespace

Link open_link(const std::string& url, std::shared_ptr<DatagramGuard> guard) {
  const auto answers = std::make_shared<Answers>(open_lcm(url), std::move(guard));
  Send send = [answers, channel_name = std::string()](std::string_view channel,
                                                      Bytes message) mutable {
    channel_name.assign(channel);
    return answers->publish(channel_name, message);
  };
  return {std::move(send), [answers] { return answers->take(); },
          [answers] { return answers->take_receipts(); },
          [answers] { return answers->take_map_poses(); }};
}

std::string with_receive_buffer(const std::string& url) {
  // LCM itself would fall back to the same two.
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const std::string fallback = environment != nullptr ? environment : "udpm://239.255.76.67:7667";
  std::string base = url.empty() ? fallback : url;
  if (!is_udp(base) || url_option(base, "recv_buf_size")) return base;
  return base + (base.find('?') == std::string::npos ? "?" : "&") +
         "recv_buf_size=" + std::to_string(kReceiveBufferBytes);
}

void listen(const ListenOptions& options, wire::KeyframeStorage& storage) {
  const std::string url = with_receive_buffer(options.url);
  const std::unique_ptr<lcm::LCM> link = open_lcm(url);
  const auto tell = [&options](const std::string& text) {
    if (options.progress && !text.empty()) options.progress(text);
  };
  tell(buffer_warning(url));

  Receiver receiver(options.limits, storage);
  DatagramGuard* const guard = options.guard.get();
  if (guard != nullptr) {
    receiver.set_check([guard](const SessionId& session, Bytes keyframe) {
      return guard->accepts(session, keyframe);
    });
  }
  Inlet inlet{receiver, guard};
  const std::uint64_t base = random_number();
  std::uint64_t told_dropped = 0;
  ReceivingThread receiving(*link, kQueueBytes);
  InboundQueue& queue = receiving.queue();
  const auto tell_status = [&] {
    ReceiverCounters counters = receiver.counters();
    counters.overflowed = queue.dropped();
    if (options.status) options.status(receiver.progress(), counters);
  };
  const auto answer = [&] {
    const std::int64_t now_ns = std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
    publish_all(*link, guard, kStoredChannel, receiver.take_stored());
    publish_all(*link, guard, kReceiptChannel,
                receiver.take_receipts(base, queue.free_bytes(), now_ns));
  };
  if (url != kNoNetwork) tell("listening on " + url);
  Watch watch(options);
  const auto tell_time = [&receiver](Clock::time_point now) {
    receiver.advance(std::chrono::nanoseconds(now.time_since_epoch()).count());
  };
  tell_time(Clock::now());
  Clock::time_point next_progress = Clock::now() + kProgressInterval;
  Clock::time_point next_answer = Clock::now();
  for (;;) {
    handle_for(queue, inlet, kPollInterval);
    if (options.feed) options.feed(receiver);
    const Clock::time_point now = Clock::now();
    tell_time(now);
    if (now >= next_answer) {
      answer();
      next_answer = now + kAnswerInterval;
    }
    if (options.map_poses) publish_all(*link, guard, kMapPoseChannel, options.map_poses());
    if (now >= next_progress) {
      tell_status();
      tell(overflow_warning(queue.dropped(), told_dropped));
      next_progress = now + kProgressInterval;
    }
    if (watch.is_over(receiver.progress(), now)) {
      receiver.store_all();
      answer();
      return tell_status();
    }
  }
}

}  // namespace unimapper::lcm_port
