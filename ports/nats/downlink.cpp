#include "ports/nats/downlink.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "ports/nats/connection.hpp"
#include "ports/nats/deliveries.hpp"
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

/// Fetches from the stream in a thread of its own.
class Fetcher final : public DeliverySource {
 public:
  explicit Fetcher(DownlinkOptions options) : options_(std::move(options)) {
    check(options_.server);
    thread_ = std::thread([this] { run(); });
  }
  ~Fetcher() override {
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

  std::deque<Delivery> take() override {
    const std::lock_guard lock(mutex_);
    bytes_ = 0;
    wake_.notify_all();
    return std::exchange(deliveries_, {});
  }

  /// On whichever connection there is.
  void answer(const std::string& reply, const std::string& text) override {
    const std::lock_guard lock(connection_mutex_);
    if (connection_ == nullptr) return;
    try {
      connection_->publish(reply, text);
    } catch (const NatsError&) {
      // The fetching thread says so.
    }
  }

  [[nodiscard]] std::uint64_t failures() const override {
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

}  // namespace

std::unique_ptr<Downlink> start_downlink(DownlinkOptions options, wire::KeyframeStorage& storage) {
  const std::size_t most_bytes = options.max_keyframe_bytes;
  const auto report = options.report;
  return make_downlink(std::make_unique<Fetcher>(std::move(options)), most_bytes, report, storage);
}

}  // namespace unimapper::nats_port
