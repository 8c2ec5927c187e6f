#include "ports/nats/uplink.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "ports/lcm/messages.hpp"
#include "ports/nats/connection.hpp"
#include "ports/nats/subjects.hpp"
#include "ports/store/outbox.hpp"

namespace unimapper::nats_port {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// What is on the way to the stream at once.
constexpr std::size_t kBatchKeyframes = 64;
constexpr std::size_t kBatchBytes = 8U << 20U;
/// Of a message beside its keyframe: its headers.
constexpr std::int64_t kHeaderBytes = 512;
constexpr milliseconds kLook{200};
constexpr milliseconds kPoll{50};
constexpr milliseconds kAnswerTimeout{10'000};
/// How often it is said how far a session is that goes on.
constexpr milliseconds kSessionInterval{10'000};
/// How often keyframes are looked for that have come below the last one.
constexpr milliseconds kRecount{60'000};
/// How often the stream is told how the site is.
constexpr milliseconds kStatusInterval{10'000};
constexpr milliseconds kFinish{5000};
/// Of the server: a message is larger than its stream takes.
constexpr int kMessageTooLarge = 10054;

/// A message with its answer.
struct Letter {
  std::string subject;
  std::string id;  ///< by which the stream knows a repetition; empty: it does not matter
  const std::vector<std::uint8_t>* bytes = nullptr;
  bool is_answered = false;
  bool is_kept = false;
  bool is_too_large = false;  ///< for the stream, though not for the server
};

/// What nobody else knows: with it another site cannot use up the id of a message. It is of the
/// run, as what is sent on demand once more must not be taken for what the stream had before.
std::string make_secret() {
  std::random_device random;
  std::string secret;
  for (int i = 0; i < 4; ++i) secret += "." + std::to_string(random());
  return secret;
}

/// What a session's message says; an end that was said is not taken back, as messages may overtake.
std::vector<std::uint8_t> message_of(const wire::SessionSummary& session) {
  wire::SessionMessage message;
  message.info = *session.info;
  message.state = session.ended ? wire::SessionState::kEnded : wire::SessionState::kStarted;
  message.keyframes = session.announced;
  message.keyframes_dropped = session.dropped_by_sender;
  return lcm_port::encode(message);
}

/// A connection, and the answers of the stream on it.
class Line {
 public:
  explicit Line(const Server& server) : connection_(server) {
    connection_.require_streams(true);
    inbox_ = connection_.make_inbox();
    natsSubscription* subscription = nullptr;
    require(
        natsConnection_SubscribeSync(&subscription, connection_.handle(), (inbox_ + "*").c_str()),
        "NATS");
    answers_.reset(subscription);
  }

  [[nodiscard]] bool is_open() const { return connection_.is_open(); }
  [[nodiscard]] std::int64_t max_payload() const { return connection_.max_payload(); }

  /// Says how the site is; what is lost is said again.
  void tell(const std::string& subject, const nlohmann::json& status) const {
    connection_.publish(subject, status.dump());
  }

  /// Sends letters and waits for the answers to all of them, or until `is_over`. Throws NatsError
  /// with the first reason that a letter was not kept; which ones were is in them.
  void exchange(std::vector<Letter>& letters, const std::function<bool()>& is_over) {
    ++batch_;
    for (std::size_t i = 0; i < letters.size(); ++i) send(letters[i], i);
    std::string reason;
    Clock::time_point last = Clock::now();
    for (std::size_t answered = 0; answered < letters.size() && !is_over();) {
      natsMsg* arrived = nullptr;
      const natsStatus status = natsSubscription_NextMsg(&arrived, answers_.get(), kPoll.count());
      if (status == NATS_TIMEOUT) {
        if (Clock::now() - last > kAnswerTimeout) {
          const char* why = nullptr;  // e.g. of missing permissions
          (void)natsConnection_GetLastError(connection_.handle(), &why);
          throw NatsError(std::string("the stream does not answer ") + (why == nullptr ? "" : why));
        }
        continue;
      }
      require(status, "the connection has ended");
      last = Clock::now();
      answered += take(Message(arrived), letters, reason) ? 1 : 0;
    }
    if (!reason.empty()) throw NatsError(reason);
  }

 private:
  void send(const Letter& letter, std::size_t number) {
    const std::string reply = inbox_ + std::to_string(batch_) + "-" + std::to_string(number);
    natsMsg* made = nullptr;
    require(natsMsg_Create(&made, letter.subject.c_str(), reply.c_str(),
                           reinterpret_cast<const char*>(letter.bytes->data()),
                           static_cast<int>(letter.bytes->size())),
            "a message");
    const Message message(made);
    if (!letter.id.empty()) {
      require(natsMsgHeader_Set(made, "Nats-Msg-Id", letter.id.c_str()), "a message");
    }
    require(natsMsgHeader_Set(made, "Nats-Expected-Stream", kKeyframeStream), "a message");
    require(natsConnection_PublishMsg(connection_.handle(), made), "the connection has ended");
  }

  /// False for an answer to an earlier batch, or to nothing.
  bool take(const Message& answer, std::vector<Letter>& letters, std::string& reason) const {
    const std::string_view subject = natsMsg_GetSubject(answer.get());
    const std::string prefix = inbox_ + std::to_string(batch_) + "-";
    if (subject.substr(0, prefix.size()) != prefix) return false;
    std::size_t number = letters.size();
    (void)std::from_chars(subject.data() + prefix.size(), subject.data() + subject.size(), number);
    if (number >= letters.size() || std::exchange(letters[number].is_answered, true)) return false;
    const std::string fault = fault_of(answer, letters[number]);
    letters[number].is_kept = fault.empty() && !letters[number].is_too_large;
    if (reason.empty()) reason = fault;
    return true;
  }

  /// Why the message was not kept; empty if it was, or is a keyframe that is too large.
  static std::string fault_of(const Message& answer, Letter& letter) {
    if (natsMsg_IsNoResponders(answer.get())) return "there is no stream, or no JetStream";
    const char* const data = natsMsg_GetData(answer.get());
    const auto json =
        nlohmann::json::parse(data, data + natsMsg_GetDataLength(answer.get()), nullptr, false);
    if (!json.is_object()) return "the stream's answer is none";
    if (!json.contains("error")) return {};
    letter.is_too_large =
        !letter.id.empty() && json["error"].value("err_code", 0) == kMessageTooLarge;
    if (letter.is_too_large) return {};
    return "the stream refuses messages: " + json["error"].value("description", "no reason given");
  }

  Connection connection_;
  std::string inbox_;
  Subscription answers_;
  std::uint64_t batch_ = 0;
};

class NatsUplink final : public Uplink {
 public:
  NatsUplink(UplinkOptions options, const store::StoreLock& held)
      : options_(std::move(options)), outbox_(options_.store, held) {
    check(options_.server);
    if (!is_site_name(options_.site)) {
      throw NatsError("a site's name is 1 to 64 letters, digits, '_' or '-'");
    }
    if (options_.sends_all) outbox_.forget_marks();
    thread_ = std::thread([this] { run(); });
  }
  ~NatsUplink() override { stop(Clock::now()); }

  UplinkCounters finish() override {
    stop(Clock::now() + kFinish);
    return counters();
  }
  [[nodiscard]] UplinkCounters counters() const override {
    const std::lock_guard lock(mutex_);
    return counters_;
  }

 private:
  void stop(Clock::time_point end) {
    {
      const std::lock_guard lock(mutex_);
      end_ = std::min(end_, end);
      is_stopping_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] bool is_over() const {
    const std::lock_guard lock(mutex_);
    return is_stopping_ && Clock::now() >= end_;
  }
  /// True once the uplink is to end.
  bool wait(milliseconds pause) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, pause, [this] { return is_stopping_; });
  }

  void run() {
    while (!is_over()) {
      bool has_sent = false;
      bool has_failed = false;
      try {
        if (Clock::now() >= next_count_) count_waiting();
        if (line_ == nullptr) connect();
        has_sent = send_some();
        if (Clock::now() >= next_status_) tell_status();
        pauses_.reset();
        tell({});
      } catch (const std::exception& error) {
        has_failed = true;
        line_.reset();
        count([](UplinkCounters& counters) { ++counters.failures; });
        // A full stream that is being emptied takes some of each batch.
        const std::uint64_t sent = counters().keyframes;
        if (sent != sent_at_failure_) pauses_.reset();
        sent_at_failure_ = sent;
        tell(error.what());
      }
      if (!has_sent && wait(has_failed ? pauses_.next() : kLook)) break;
    }
    try {
      if (line_ != nullptr) tell_status();
    } catch (const std::exception&) {
      // Then the latest that it said stands.
    }
  }

  void count_waiting() {
    next_count_ = Clock::now() + kStatusInterval;
    const std::uint64_t waiting = outbox_.unmarked();
    count([waiting](UplinkCounters& counters) { counters.waiting = waiting; });
  }

  void tell_status() {
    next_status_ = Clock::now() + kStatusInterval;
    count_waiting();
    const UplinkCounters sent = counters();
    line_->tell("unimapper." + options_.site + ".status",
                {{"waiting", sent.waiting},
                 {"too_large", left_out_},
                 {"damaged", outbox_.damaged()},
                 {"sent_since_start", sent.keyframes},
                 {"failures_since_start", sent.failures}});
  }

  void connect() {
    line_ = std::make_unique<Line>(options_.server);
    start_over();
  }
  void start_over() {
    outbox_.start_over();
    is_idle_ = false;
    left_out_ = 0;
    recount_ = Clock::now() + kRecount;
  }

  /// False if there is nothing to send now.
  bool send_some() {
    if (!line_->is_open()) throw NatsError("the connection has ended");
    if (!outbox_.has_changed() && is_idle_ && Clock::now() < next_progress_) return false;
    is_idle_ = false;
    store::Outbox::Marks outgoing;
    outgoing.keyframes = outbox_.next(kBatchKeyframes, kBatchBytes);
    const bool is_at_end = outgoing.keyframes.empty();
    outgoing.sessions = due_sessions(outgoing.keyframes);
    std::erase_if(outgoing.keyframes, [this](const auto& one) { return is_too_large(one); });
    if (outgoing.keyframes.empty() && outgoing.sessions.empty()) {
      if (is_at_end) look_below();
      is_idle_ = is_at_end;
      return !is_at_end;
    }
    send(outgoing);
    return true;
  }

  /// Where sessions were removed and others came, rows are used again.
  void look_below() {
    if (Clock::now() < recount_) return;
    recount_ = Clock::now() + kRecount;
    if (outbox_.unmarked() > left_out_ + outbox_.damaged()) start_over();
  }

  /// Those that have changed: new ones with their first keyframe, the others after their last one.
  std::vector<store::OutgoingSession> due_sessions(
      const std::vector<store::OutgoingKeyframe>& keyframes) {
    std::set<std::int64_t> touched;
    for (const store::OutgoingKeyframe& keyframe : keyframes) touched.insert(keyframe.session);
    const bool is_at_end = keyframes.empty();
    const bool tells_progress = is_at_end && Clock::now() >= next_progress_;
    if (tells_progress) next_progress_ = Clock::now() + kSessionInterval;
    std::vector<store::OutgoingSession> due;
    for (store::OutgoingSession& session : outbox_.sessions()) {
      std::vector<std::uint8_t> message = message_of(session.summary);
      if (message == session.handed_over) continue;
      const bool is_new = session.handed_over.empty();
      const bool is_due = is_at_end ? is_new || session.summary.ended || tells_progress
                                    : is_new && touched.count(session.row) > 0;
      if (!is_due || due.size() == kBatchKeyframes) continue;
      session.handed_over = std::move(message);
      due.push_back(std::move(session));
    }
    return due;
  }

  bool is_too_large(const store::OutgoingKeyframe& keyframe) {
    const auto bytes = static_cast<std::int64_t>(keyframe.bytes.size()) + kHeaderBytes;
    if (bytes <= line_->max_payload()) return false;
    leave_out(keyframe, "the server takes messages of " + std::to_string(line_->max_payload()) +
                            " (max_payload in its configuration)");
    return true;
  }

  void leave_out(const store::OutgoingKeyframe& keyframe, const std::string& reason) {
    ++left_out_;
    count([](UplinkCounters& counters) { ++counters.too_large; });
    if (std::exchange(told_too_large_, true)) return;
    options_.report("warning: a keyframe of " + std::to_string(keyframe.bytes.size()) +
                    " bytes stays at the site: " + reason);
  }

  void send(store::Outbox::Marks& outgoing) {
    std::vector<Letter> letters;
    for (const store::OutgoingKeyframe& one : outgoing.keyframes) {
      const std::string text = to_text({options_.site, one.name.session, one.name.sequence});
      const std::string checksum = std::to_string(wire::crc32(one.bytes));
      letters.push_back({text, text + "." + checksum + secret_, &one.bytes});
    }
    for (const store::OutgoingSession& one : outgoing.sessions) {
      letters.push_back(
          {to_text({options_.site, one.summary.id, std::nullopt}), {}, &one.handed_over});
    }
    try {
      line_->exchange(letters, [this] { return is_over(); });
    } catch (const NatsError&) {
      mark(outgoing, letters);
      throw;
    }
    mark(outgoing, letters);
  }

  /// Marks what the stream has kept; the rest is found again after a start.
  void mark(store::Outbox::Marks& outgoing, const std::vector<Letter>& letters) {
    std::size_t number = 0;  // of the letter
    store::Outbox::Marks kept;
    for (auto& one : outgoing.keyframes) {
      const Letter& letter = letters[number++];
      if (letter.is_too_large) leave_out(one, "the stream takes no message as large");
      if (letter.is_kept) kept.keyframes.push_back(std::move(one));
    }
    for (auto& one : outgoing.sessions) {
      if (letters[number++].is_kept) kept.sessions.push_back(std::move(one));
    }
    if (kept.keyframes.empty() && kept.sessions.empty()) return;
    outbox_.mark(kept);
    count([&kept](UplinkCounters& counters) {
      counters.keyframes += kept.keyframes.size();
      counters.sessions += kept.sessions.size();
    });
  }

  template <typename Change>
  void count(const Change& change) {
    const std::lock_guard lock(mutex_);
    change(counters_);
  }

  void tell(const std::string& trouble) {
    if (trouble == trouble_) return;
    trouble_ = trouble;
    options_.report(trouble.empty()
                        ? "the uplink sends to " + shown(options_.server)
                        : "warning: the uplink waits, and it is tried again: " + trouble);
  }

  UplinkOptions options_;
  const std::string secret_ = make_secret();
  store::Outbox outbox_;        ///< the thread's own, as all up to `trouble_`
  std::unique_ptr<Line> line_;  ///< null: not connected
  Pauses pauses_;
  std::uint64_t sent_at_failure_ = 0;
  std::uint64_t left_out_ = 0;  ///< too large, since the outbox was started over
  bool told_too_large_ = false;
  Clock::time_point recount_{};
  Clock::time_point next_progress_{};
  Clock::time_point next_status_{};
  Clock::time_point next_count_{};
  bool is_idle_ = false;                           ///< nothing was to be sent at the last look
  std::string trouble_ = "nothing was tried yet";  ///< as it was told last
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool is_stopping_ = false;
  Clock::time_point end_ = Clock::time_point::max();
  UplinkCounters counters_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Uplink> start_uplink(UplinkOptions options, const store::StoreLock& held) {
  return std::make_unique<NatsUplink>(std::move(options), held);
}

}  // namespace unimapper::nats_port
