// Board of jobs on JetStream: a work queue, a stream of answers, and one of keyframes.
#include "ports/nats/job_board.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "ports/nats/connection.hpp"

namespace unimapper::nats_port {
namespace {

constexpr const char* kJobs = "JOBS";
constexpr const char* kAnswers = "ANSWERS";
constexpr const char* kJobKeyframes = "JOB_KEYFRAMES";
constexpr const char* kJobSubject = "unimapper-job.";               // VERSION.PROJECT
constexpr const char* kAnswerSubject = "unimapper-answer.";         // PROJECT
constexpr const char* kKeyframeSubject = "unimapper-jobkeyframe.";  // NAME

constexpr std::int64_t kSecondNs = 1'000'000'000;
/// Jobs, answers and keyframes are of no use to a merge of another day.
constexpr std::int64_t kKeptNs = 86'400 * kSecondNs;
/// A worker that has told no progress in this time is taken for dead; its job goes to another one.
constexpr std::int64_t kProgressNs = 20 * kSecondNs;
constexpr std::int64_t kMostJobBytes = std::int64_t{64} << 20;
constexpr std::int64_t kMostAnswerBytes = std::int64_t{128} << 20;
constexpr std::int64_t kMostKeyframeBytes = std::int64_t{2} << 30;
/// How often a caller that waits looks for an answer that it was not told of.
constexpr std::chrono::milliseconds kAnswerPoll{200};
/// More unanswered jobs than any fleet has workers.
constexpr std::int64_t kMostTaken = 10'000;

using StreamInfo = std::unique_ptr<jsStreamInfo, Destroyer<&jsStreamInfo_Destroy>>;
using ConsumerInfo = std::unique_ptr<jsConsumerInfo, Destroyer<&jsConsumerInfo_Destroy>>;

struct StreamShape {
  const char* name;
  const char* subjects;
  jsRetentionPolicy retention;
  std::int64_t max_bytes;
  std::int64_t max_per_subject;
};

void require_stream(const Connection& connection, const StreamShape& shape) {
  jsStreamInfo* info = nullptr;
  natsStatus status = js_GetStreamInfo(&info, connection.jetstream(), shape.name, nullptr, nullptr);
  if (status == NATS_NOT_FOUND) {
    const char* subjects[] = {shape.subjects};
    jsStreamConfig config;
    require(jsStreamConfig_Init(&config), "the stream");
    config.Name = shape.name;
    config.Subjects = subjects;
    config.SubjectsLen = 1;
    config.Storage = js_FileStorage;
    config.Retention = shape.retention;
    config.MaxAge = kKeptNs;
    config.MaxBytes = shape.max_bytes;
    config.MaxMsgsPerSubject = shape.max_per_subject;
    config.AllowDirect = true;
    config.Replicas = connection.replicas();
    status = js_AddStream(&info, connection.jetstream(), &config, nullptr, nullptr);
  }
  const StreamInfo made(info);
  require(status, std::string("the stream ") + shape.name);
}

void require_streams(const Connection& connection) {
  require_stream(connection, {kJobs, "unimapper-job.*.*", js_WorkQueuePolicy, kMostJobBytes, -1});
  require_stream(connection,
                 {kAnswers, "unimapper-answer.*", js_LimitsPolicy, kMostAnswerBytes, -1});
  require_stream(connection, {kJobKeyframes, "unimapper-jobkeyframe.*", js_LimitsPolicy,
                              kMostKeyframeBytes, 1});
}

std::string consumer_name(const std::string& version) { return "workers-" + version; }

/// The workers of a version share one consumer.
void require_consumer(const Connection& connection, const std::string& version) {
  const std::string name = consumer_name(version);
  const std::string filter = kJobSubject + version + ".*";
  jsConsumerConfig config;
  require(jsConsumerConfig_Init(&config), "the workers");
  config.Durable = name.c_str();
  config.FilterSubject = filter.c_str();
  config.AckPolicy = js_AckExplicit;
  config.AckWait = kProgressNs;
  config.MaxAckPending = kMostTaken;
  jsConsumerInfo* info = nullptr;
  const natsStatus status =
      js_AddConsumer(&info, connection.jetstream(), kJobs, &config, nullptr, nullptr);
  const ConsumerInfo made(info);
  require(status, "the workers' consumer");
}

std::string data_of(const natsMsg* message) {
  return {natsMsg_GetData(message), static_cast<std::size_t>(natsMsg_GetDataLength(message))};
}

/// The number of what was published, once the stream has it.
std::uint64_t publish(const Connection& connection, const std::string& subject, const void* data,
                      std::size_t bytes, jsPubOptions* options = nullptr) {
  if (static_cast<std::int64_t>(bytes) > connection.max_payload()) {
    throw NatsError(std::to_string(bytes) + " bytes are more than the server takes: raise " +
                    "max_payload in its configuration");
  }
  jsPubAck* ack = nullptr;
  const natsStatus status = js_Publish(&ack, connection.jetstream(), subject.c_str(), data,
                                       static_cast<int>(bytes), options, nullptr);
  const std::unique_ptr<jsPubAck, Destroyer<&jsPubAck_Destroy>> kept(ack);
  require(status, subject);
  return ack->Sequence;
}

class Board final : public JobBoard {
 public:
  Board(const Server& server, BoardNames names) : connection_(server), names_(std::move(names)) {
    require_streams(connection_);
    require_consumer(connection_, names_.version);
    natsSubscription* subscription = nullptr;
    require(natsConnection_SubscribeSync(&subscription, connection_.handle(), answers().c_str()),
            kAnswers);
    told_.reset(subscription);
    take_off();
  }

  void put_keyframe(const std::string& name, std::span<const std::uint8_t> bytes) override {
    jsPubOptions options;
    require(jsPubOptions_Init(&options), name);
    options.MsgId = name.c_str();
    publish(connection_, kKeyframeSubject + name, bytes.data(), bytes.size(), &options);
  }

  std::uint64_t put_job(const std::string& text) override {
    return publish(connection_, subject(), text.data(), text.size());
  }

  bool take_back(std::uint64_t number) override {
    jsConsumerInfo* found = nullptr;
    const natsStatus status =
        js_GetConsumerInfo(&found, connection_.jetstream(), kJobs,
                           consumer_name(names_.version).c_str(), nullptr, nullptr);
    const ConsumerInfo info(found);
    require(status, "the workers' consumer");
    if (info->Delivered.Stream >= number) return false;
    // A worker may have taken it just now: then it is verified twice, to the same outcome.
    return js_DeleteMsg(connection_.jetstream(), kJobs, number, nullptr, nullptr) == NATS_OK;
  }

  std::optional<std::string> next_answer(std::chrono::milliseconds wait) override {
    const auto end = std::chrono::steady_clock::now() + wait;
    for (;;) {
      if (auto answer = next_kept()) return answer;
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      if (left.count() <= 0) return std::nullopt;
      wait_to_be_told(std::min(left, kAnswerPoll));
    }
  }

 private:
  [[nodiscard]] std::string subject() const {
    return kJobSubject + names_.version + "." + names_.project;
  }
  [[nodiscard]] std::string answers() const { return kAnswerSubject + names_.project; }

  /// An answer passes by on its way into the stream, where it may be found a little later.
  void wait_to_be_told(std::chrono::milliseconds wait) {
    constexpr std::chrono::milliseconds kStored{1};
    natsMsg* passing = nullptr;
    const natsStatus status = natsSubscription_NextMsg(&passing, told_.get(), wait.count());
    const Message message(passing);
    // The stream has also what was not kept for want of memory.
    if (status == NATS_TIMEOUT || status == NATS_SLOW_CONSUMER) return;
    require(status, kAnswers);
    std::this_thread::sleep_for(kStored);
  }

  /// Jobs of a caller that was killed: who asks again, asks anew.
  void take_off() {
    const std::string own = subject();
    jsOptions options;
    require(jsOptions_Init(&options), kJobs);
    options.Stream.Purge.Subject = own.c_str();
    require(js_PurgeStream(connection_.jetstream(), kJobs, &options, nullptr), kJobs);
  }

  /// The first answer after the one that was read last. A consumer's state could be lost; a number
  /// cannot.
  std::optional<std::string> next_kept() {
    jsDirectGetMsgOptions options;
    require(jsDirectGetMsgOptions_Init(&options), kAnswers);
    const std::string own = answers();
    options.Sequence = read_ + 1;
    options.NextBySubject = own.c_str();
    natsMsg* found = nullptr;
    const natsStatus status =
        js_DirectGetMsg(&found, connection_.jetstream(), kAnswers, nullptr, &options);
    const Message message(found);
    if (status == NATS_NOT_FOUND) return std::nullopt;
    require(status, "answers");
    read_ = natsMsg_GetSequence(found);
    return data_of(found);
  }

  Connection connection_;
  BoardNames names_;
  Subscription told_;       ///< of answers as they are given
  std::uint64_t read_ = 0;  ///< number of the answer that was read last
};

class Source final : public JobSource {
 public:
  Source(const Server& server, std::string version)
      : connection_(server), version_(std::move(version)) {
    require_streams(connection_);
    require_consumer(connection_, version_);
    jsSubOptions options;
    require(jsSubOptions_Init(&options), kJobs);
    options.Stream = kJobs;
    const std::string name = consumer_name(version_);
    options.Consumer = name.c_str();
    natsSubscription* subscription = nullptr;
    const std::string filter = kJobSubject + version_ + ".*";
    require(js_PullSubscribe(&subscription, connection_.jetstream(), filter.c_str(), name.c_str(),
                             nullptr, &options, nullptr),
            kJobs);
    jobs_.reset(subscription);
  }

  std::optional<TakenJob> next_job(std::chrono::milliseconds wait) override {
    natsMsgList list{};
    const natsStatus status = natsSubscription_Fetch(
        &list, jobs_.get(), 1, std::max<std::int64_t>(1, wait.count()), nullptr);
    if (status == NATS_TIMEOUT) return std::nullopt;
    require(status, "jobs");
    if (list.Count > 0) taken_.reset(std::exchange(list.Msgs[0], nullptr));
    const bool is_taken = list.Count > 0;
    natsMsgList_Destroy(&list);
    if (!is_taken) return std::nullopt;
    jsMsgMetaData* found = nullptr;
    require(natsMsg_GetMetaData(&found, taken_.get()), "a job");
    const std::unique_ptr<jsMsgMetaData, Destroyer<&jsMsgMetaData_Destroy>> data(found);
    return TakenJob{data_of(taken_.get()), static_cast<std::uint32_t>(data->NumDelivered)};
  }

  void tell_progress() override {
    if (taken_) require(natsMsg_InProgress(taken_.get(), nullptr), "a job");
  }

  void answer(const std::string& text) override {
    const std::string_view subject = natsMsg_GetSubject(taken_.get());
    const std::string project(subject.substr(subject.rfind('.') + 1));
    publish(connection_, kAnswerSubject + project, text.data(), text.size());
    require(natsMsg_Ack(taken_.get(), nullptr), "a job");
    taken_.reset();
  }

  std::vector<std::uint8_t> keyframe(const std::string& name) override {
    natsMsg* found = nullptr;
    const std::string subject = kKeyframeSubject + name;
    const natsStatus status = js_GetLastMsg(&found, connection_.jetstream(), kJobKeyframes,
                                            subject.c_str(), nullptr, nullptr);
    const Message message(found);
    require(status, "keyframe " + name);
    const auto* data = natsMsg_GetData(found);
    return {data, data + natsMsg_GetDataLength(found)};
  }

  std::vector<std::string> versions_wanted() override {
    jsOptions options;
    require(jsOptions_Init(&options), kJobs);
    options.Stream.Info.SubjectsFilter = "unimapper-job.>";
    jsStreamInfo* found = nullptr;
    const natsStatus status =
        js_GetStreamInfo(&found, connection_.jetstream(), kJobs, &options, nullptr);
    const StreamInfo info(found);
    require(status, kJobs);
    std::set<std::string> versions;
    const jsStreamStateSubjects* subjects = info->State.Subjects;
    for (int i = 0; subjects != nullptr && i < subjects->Count; ++i) {
      std::string_view subject = subjects->List[i].Subject;
      subject.remove_prefix(std::string_view(kJobSubject).size());
      versions.emplace(subject.substr(0, subject.find('.')));
    }
    return {versions.begin(), versions.end()};
  }

 private:
  Connection connection_;
  std::string version_;
  Subscription jobs_;
  Message taken_;
};

}  // namespace

std::unique_ptr<JobBoard> open_board(const Server& server, const BoardNames& names) {
  return std::make_unique<Board>(server, names);
}

std::unique_ptr<JobSource> open_source(const Server& server, const std::string& version) {
  return std::make_unique<Source>(server, version);
}

}  // namespace unimapper::nats_port
