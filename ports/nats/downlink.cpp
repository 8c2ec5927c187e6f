#include "ports/nats/downlink.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/nats/connection.hpp"
#include "ports/nats/subjects.hpp"

namespace unimapper::nats_port {

namespace {

using std::chrono::milliseconds;

/// Fetched ahead of the receiver, beside one fetch.
constexpr std::size_t kAheadMessages = 256;
constexpr std::size_t kAheadBytes = 8U << 20U;
constexpr int kFetchMessages = 16;
constexpr std::int64_t kFetchMs = 200;
/// How often the server is asked whether all is well while nothing comes.
constexpr milliseconds kLookInterval{5000};
/// Postponed messages come after 1, 2, 4, ... seconds, at last after 1024.
constexpr std::uint64_t kLongestPauseExponent = 10;
/// A session so often without a keyframe will never have one: 26 hours.
constexpr std::uint64_t kMaxDeliveries = 100;

/// A message that waits for its answer.
struct Delivery {
  std::string subject;
  std::string reply;         ///< where its answer goes
  std::uint64_t number = 1;  ///< how often it was sent so far
  std::vector<std::uint8_t> bytes;
};

/// Fetches from the stream in a thread of its own.
class Fetcher {
 public:
  explicit Fetcher(DownlinkOptions options) : options_(std::move(options)) {
    check(options_.server);
    thread_ = std::thread([this] { run(); });
  }
  ~Fetcher() {
    {
      const std::lock_guard lock(mutex_);
      is_stopping_ = true;
    }
    wake_.notify_all();
    thread_.join();
    // What was answered last.
    if (connection_ != nullptr) (void)natsConnection_FlushTimeout(connection_->handle(), 1000);
  }
  Fetcher(const Fetcher&) = delete;
  Fetcher& operator=(const Fetcher&) = delete;

  /// What has come, in the order of the stream.
  std::deque<Delivery> take() {
    const std::lock_guard lock(mutex_);
    bytes_ = 0;
    wake_.notify_all();
    return std::exchange(deliveries_, {});
  }

  /// Answers what was delivered, on whichever connection there is: one that is lost comes again.
  void answer(const std::string& reply, const std::string& text) {
    const std::lock_guard lock(connection_mutex_);
    if (connection_ == nullptr) return;
    try {
      connection_->publish(reply, text);
    } catch (const NatsError&) {
      // The fetching thread says so.
    }
  }

  [[nodiscard]] std::uint64_t failures() const {
    const std::lock_guard lock(mutex_);
    return failures_;
  }

 private:
  void run() {
    while (!wait(pause_)) {
      try {
        connect();
        pauses_.reset();
        tell({});
        while (!wait_for_room()) fetch();
        return;
      } catch (const std::exception& error) {
        {
          const std::lock_guard lock(mutex_);
          ++failures_;
        }
        tell(error.what());
        pause_ = pauses_.next();
      }
    }
  }

  void connect() {
    subscription_.reset();
    auto connection = std::make_unique<Connection>(options_.server);
    connection->require_streams();
    jsConsumerConfig config;
    require(jsConsumerConfig_Init(&config), "the consumer");
    config.Durable = kCentre;
    config.AckPolicy = js_AckExplicit;
    config.AckWait = std::chrono::nanoseconds(options_.redelivery).count();
    // What a quota refuses waits at the server and must not keep the rest from coming.
    config.MaxAckPending = -1;
    require(js_AddConsumer(nullptr, connection->jetstream(), kKeyframeStream, &config, nullptr,
                           nullptr),
            "the consumer");
    jsSubOptions binding;
    require(jsSubOptions_Init(&binding), "the consumer");
    binding.Stream = kKeyframeStream;
    binding.Consumer = kCentre;
    natsSubscription* subscription = nullptr;
    require(js_PullSubscribe(&subscription, connection->jetstream(), nullptr, nullptr, nullptr,
                             &binding, nullptr),
            "the consumer");
    subscription_.reset(subscription);
    const std::lock_guard lock(connection_mutex_);
    connection_ = std::move(connection);
  }

  void fetch() {
    natsMsgList list{};
    const natsStatus status =
        natsSubscription_Fetch(&list, subscription_.get(), kFetchMessages, kFetchMs, nullptr);
    if (status == NATS_TIMEOUT) {
      if (!connection_->is_open()) throw NatsError("the connection has ended");
      if (std::chrono::steady_clock::now() >= next_look_) look();
      return;
    }
    require(status, "the connection has ended");
    for (int i = 0; i < list.Count; ++i) push(list.Msgs[i]);
    natsMsgList_Destroy(&list);
  }

  /// Throws NatsError for a link without an answer, for missing permissions, and where the stream
  /// holds messages that the consumer will never send: a power failure has set the stream back
  /// behind it. Then the consumer is removed, and made anew with the next connection.
  void look() {
    next_look_ = std::chrono::steady_clock::now() + kLookInterval;
    const char* reason = nullptr;
    if (natsConnection_GetLastError(connection_->handle(), &reason) != NATS_OK) {
      throw NatsError(reason == nullptr ? "the server refuses something" : reason);
    }
    jsCtx* const jetstream = connection_->jetstream();
    jsStreamInfo* stream = nullptr;
    require(js_GetStreamInfo(&stream, jetstream, kKeyframeStream, nullptr, nullptr), "the stream");
    const std::uint64_t held = stream->State.Msgs;
    jsStreamInfo_Destroy(stream);
    jsConsumerInfo* consumer = nullptr;
    require(js_GetConsumerInfo(&consumer, jetstream, kKeyframeStream, kCentre, nullptr, nullptr),
            "the consumer");
    const std::uint64_t known =
        consumer->NumPending + static_cast<std::uint64_t>(consumer->NumAckPending);
    jsConsumerInfo_Destroy(consumer);
    const bool is_behind = held > known;
    // Between the two questions something may have been acknowledged.
    if (!std::exchange(was_behind_, is_behind) || !is_behind) {
      if (is_behind) next_look_ = {};
      return;
    }
    was_behind_ = false;
    require(js_DeleteConsumer(jetstream, kKeyframeStream, kCentre, nullptr, nullptr),
            "the consumer");
    throw NatsError("the stream has lost messages and is read from its beginning");
  }

  void push(natsMsg* message) {
    // What is forged may have no place for an answer.
    if (natsMsg_GetReply(message) == nullptr) return;
    const auto* const data = reinterpret_cast<const std::uint8_t*>(natsMsg_GetData(message));
    Delivery delivery{natsMsg_GetSubject(message),
                      natsMsg_GetReply(message),
                      1,
                      {data, data + natsMsg_GetDataLength(message)}};
    jsMsgMetaData* about = nullptr;
    if (natsMsg_GetMetaData(&about, message) == NATS_OK) delivery.number = about->NumDelivered;
    jsMsgMetaData_Destroy(about);
    const std::lock_guard lock(mutex_);
    bytes_ += delivery.bytes.size();
    deliveries_.push_back(std::move(delivery));
  }

  /// True once it is to end.
  bool wait(milliseconds pause) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, pause, [this] { return is_stopping_; });
  }
  bool wait_for_room() {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] {
      return is_stopping_ || (deliveries_.size() < kAheadMessages && bytes_ < kAheadBytes);
    });
    return is_stopping_;
  }

  void tell(const std::string& trouble) {
    if (trouble == trouble_) return;
    trouble_ = trouble;
    options_.report(trouble.empty()
                        ? "taking keyframes from " + shown(options_.server)
                        : "warning: nothing comes from the sites, and it is tried again: " +
                              trouble);
  }

  DownlinkOptions options_;
  Pauses pauses_;  ///< the thread's own, as all up to `trouble_`
  milliseconds pause_{0};
  Subscription subscription_;
  std::chrono::steady_clock::time_point next_look_{};
  bool was_behind_ = false;  ///< at the last look: the consumer behind the stream
  std::string trouble_ = "nothing was tried yet";  ///< as it was told last
  std::mutex connection_mutex_;
  std::unique_ptr<Connection> connection_;  ///< replaced by the thread only
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool is_stopping_ = false;
  std::uint64_t failures_ = 0;
  std::size_t bytes_ = 0;  ///< of `deliveries_`
  std::deque<Delivery> deliveries_;
  std::thread thread_;
};

class NatsDownlink final : public Downlink {
 public:
  NatsDownlink(DownlinkOptions options, wire::KeyframeStorage& storage)
      : max_keyframe_bytes_(options.max_keyframe_bytes),
        report_(options.report),
        storage_(storage),
        fetcher_(std::move(options)) {}

  void take(wire::Receiver& receiver) override {
    settle_sessions(receiver);
    if (!storage_.accepts()) return;  // what is postponed instead would come much later
    for (Delivery& delivery : fetcher_.take()) {
      ++counters_.messages;
      const auto subject = parse_subject(delivery.subject);
      if (!subject) {
        drop(delivery, "it is about no keyframe");
      } else if (subject->sequence) {
        take_keyframe(receiver, *subject, delivery);
      } else {
        take_session(receiver, *subject, delivery);
      }
    }
  }
  [[nodiscard]] DownlinkCounters counters() const override {
    DownlinkCounters counters = counters_;
    counters.failures = fetcher_.failures();
    return counters;
  }

  Taken keep(wire::ReceivedKeyframe&& keyframe) override {
    const wire::KeyframeName name{keyframe.record.session, keyframe.record.sequence};
    const Taken taken = storage_.keep(std::move(keyframe));
    if (taken == Taken::kWaiting) keyframes_.try_emplace(name);
    return taken;
  }
  void keep(const wire::SessionSummary& summary) override {
    storage_.keep(summary);
    auto handed_over = handed_over_.extract(summary.id);
    if (handed_over.empty()) return;
    // Says what an earlier one said, and more.
    const auto earlier = sessions_.find(summary.id);
    if (earlier != sessions_.end()) accept(earlier->second.reply);
    sessions_[summary.id] = std::move(handed_over.mapped());
  }
  void keep(wire::ReceivedSummary&& summary) override { storage_.keep(std::move(summary)); }
  void remove_summary(const wire::KeyframeName& name) override { storage_.remove_summary(name); }
  void keep(const wire::HealthMessage& health) override { storage_.keep(health); }
  wire::Committed commit_due(std::int64_t now_ns) override {
    return acknowledge_stored(storage_.commit_due(now_ns));
  }
  wire::Committed commit_all(std::int64_t now_ns) override {
    return acknowledge_stored(storage_.commit_all(now_ns));
  }
  std::optional<wire::StoredSession> find(const SessionId& id) override {
    return storage_.find(id);
  }
  [[nodiscard]] std::vector<wire::RobotUsage> usage() const override { return storage_.usage(); }
  [[nodiscard]] bool accepts() const override { return storage_.accepts(); }
  [[nodiscard]] bool is_durable() const override { return storage_.is_durable(); }

 private:
  void take_keyframe(wire::Receiver& receiver, const Subject& subject, Delivery& delivery) {
    const std::size_t bytes = delivery.bytes.size();
    if (bytes == 0 || bytes > max_keyframe_bytes_)
      return drop(delivery, "its size is no keyframe's");
    const wire::KeyframeName name{subject.session, *subject.sequence};
    wire::ChunkMessage whole;
    whole.session = name.session;
    whole.sequence = name.sequence;
    whole.count = 1;
    whole.total_bytes = static_cast<std::uint32_t>(bytes);
    whole.payload_crc32 = wire::crc32(delivery.bytes);
    whole.data = std::move(delivery.bytes);
    const wire::ReceiverCounters before = receiver.counters();
    receiver.receive(std::move(whole));
    const wire::ReceiverCounters after = receiver.counters();
    if (after.keyframes_damaged > before.keyframes_damaged) {
      return drop(delivery, "it is damaged, forged or not signed");
    }
    if (after.refused > before.refused) return postpone(delivery);
    const auto waiting = keyframes_.find(name);
    if (waiting == keyframes_.end()) return accept(delivery.reply);
    waiting->second = delivery.reply;
  }

  void take_session(wire::Receiver& receiver, const Subject& subject, Delivery& delivery) {
    const auto message = lcm_port::decode_session(delivery.bytes);
    if (!message || message->info.id != subject.session) {
      return drop(delivery, "it is no message of that session");
    }
    const wire::ReceiverCounters before = receiver.counters();
    receiver.receive(*message);
    const wire::ReceiverCounters after = receiver.counters();
    if (after.contradictory > before.contradictory) {
      return drop(delivery, "it gives a session another name");
    }
    if (after.refused > before.refused) return postpone(delivery);
    const auto earlier = handed_over_.find(subject.session);
    if (earlier != handed_over_.end()) accept(earlier->second.reply);
    handed_over_[subject.session] = std::move(delivery);
  }

  /// Sessions that the receiver was told of before it was advanced last, and that it did not hand
  /// on to be stored: they say nothing new, or have no keyframe yet.
  void settle_sessions(const wire::Receiver& receiver) {
    if (handed_over_.empty()) return;
    for (const wire::SessionProgress& session : receiver.progress()) {
      if (session.received + session.waiting + session.summaries == 0) continue;
      const auto handed_over = handed_over_.extract(session.info.id);
      if (!handed_over.empty()) accept(handed_over.mapped().reply);
    }
    for (const auto& [id, delivery] : std::exchange(handed_over_, {})) {
      if (delivery.number < kMaxDeliveries) {
        postpone(delivery);
      } else {
        drop(delivery, "its session has no keyframe");
      }
    }
  }

  wire::Committed acknowledge_stored(wire::Committed committed) {
    for (const wire::KeyframeName& name : committed.keyframes) {
      const auto waiting = keyframes_.extract(name);
      // Some came from robots.
      if (!waiting.empty() && !waiting.mapped().empty()) accept(waiting.mapped());
    }
    for (const wire::SessionSummary& summary : committed.sessions) {
      const auto waiting = sessions_.extract(summary.id);
      if (!waiting.empty()) accept(waiting.mapped().reply);
    }
    return committed;
  }

  void accept(const std::string& reply) {
    ++counters_.stored;
    fetcher_.answer(reply, "+ACK");
  }
  void postpone(const Delivery& delivery) {
    ++counters_.postponed;
    const std::uint64_t exponent = std::min(delivery.number - 1, kLongestPauseExponent);
    const std::uint64_t pause_ns = 1'000'000'000ULL << exponent;
    fetcher_.answer(delivery.reply, "-NAK {\"delay\": " + std::to_string(pause_ns) + "}");
  }
  void drop(const Delivery& delivery, const std::string& reason) {
    fetcher_.answer(delivery.reply, "+TERM");
    if (counters_.dropped++ > 0) return;
    report_("warning: a message from " + delivery.subject +
            " was dropped, as others will be: " + reason);
  }

  std::size_t max_keyframe_bytes_;
  std::function<void(const std::string&)> report_;
  wire::KeyframeStorage& storage_;
  Fetcher fetcher_;
  DownlinkCounters counters_;
  std::map<wire::KeyframeName, std::string> keyframes_;  ///< not committed; where answers go
  std::map<SessionId, Delivery> handed_over_;            ///< to the receiver
  std::map<SessionId, Delivery> sessions_;               ///< to the storage, not committed
};

}  // namespace

std::unique_ptr<Downlink> start_downlink(DownlinkOptions options, wire::KeyframeStorage& storage) {
  return std::make_unique<NatsDownlink>(std::move(options), storage);
}

}  // namespace unimapper::nats_port
