// Board of jobs on JetStream: a work queue, a stream of answers, and one of keyframes.
#include "ports/nats/job_board.hpp"

#include <algorithm>
#include <charconv>
#include <compare>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include "ports/nats/connection.hpp"
#include "ports/nats/lane_choice.hpp"

namespace unimapper::nats_port {
namespace {

constexpr const char* kJobs = "JOBS";
constexpr const char* kAnswers = "ANSWERS";
constexpr const char* kJobKeyframes = "JOB_KEYFRAMES";
constexpr const char* kJobSubject = "unimapper-job.";               // VERSION-LANE.PROJECT
constexpr const char* kAnswerSubject = "unimapper-answer.";         // PROJECT
constexpr const char* kKeyframeSubject = "unimapper-jobkeyframe.";  // NAME
/// Tells workers of a version that a job was put; in no stream.
constexpr const char* kToldSubject = "unimapper-jobtold.";  // VERSION

constexpr std::int64_t kSecondNs = 1'000'000'000;
/// Jobs, answers and keyframes are of no use to a merge of another day.
constexpr std::int64_t kKeptNs = 86'400 * kSecondNs;
constexpr std::int64_t kMostJobBytes = std::int64_t{64} << 20;
constexpr std::int64_t kMostAnswerBytes = std::int64_t{128} << 20;
constexpr std::int64_t kMostKeyframeBytes = std::int64_t{2} << 30;
/// How often who waits looks for a job or an answer that it was not told of.
constexpr std::chrono::milliseconds kToldPoll{200};
constexpr std::chrono::milliseconds kNow{0};
/// How long one looks for a job in a lane; where there is none, the server takes all of it. A
/// glance is for one that may have ended its worker.
constexpr std::int64_t kFetchNs = kSecondNs / 2;
constexpr std::int64_t kGlanceNs = kSecondNs / 50;
/// Each lane that workers look at has a consumer on the server.
constexpr std::uint32_t kMostLanes = 64;
/// Jobs of a lane that no worker has ever come to: more than in any other.
constexpr std::uint64_t kUntouched = UINT64_MAX;
/// The server tells of jobs that it has given out too often; in no stream. A worker cannot.
constexpr const char* kSetAsideSubject = "$JS.EVENT.ADVISORY.CONSUMER.MAX_DELIVERIES.JOBS.*";
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

/// Jobs of a lane go to workers of a version in their order.
std::string lane_name(const std::string& version, std::uint32_t lane) {
  return version + "-" + std::to_string(lane);
}
std::string consumer_name(const std::string& lane) { return "workers-" + lane; }

/// The workers of a version share one consumer for each lane.
void require_consumer(const Connection& connection, const std::string& lane,
                      std::chrono::nanoseconds progress) {
  const std::string name = consumer_name(lane);
  const std::string filter = kJobSubject + lane + ".*";
  jsConsumerConfig config;
  require(jsConsumerConfig_Init(&config), "the workers");
  config.Durable = name.c_str();
  config.FilterSubject = filter.c_str();
  config.AckPolicy = js_AckExplicit;
  config.AckWait = progress.count();
  config.MaxDeliver = kMostDeliveries;
  config.MaxAckPending = kMostTaken;
  jsConsumerInfo* info = nullptr;
  const natsStatus status =
      js_AddConsumer(&info, connection.jetstream(), kJobs, &config, nullptr, nullptr);
  const ConsumerInfo made(info);
  require(status, "the workers' consumer");
}

/// Null where there is none.
ConsumerInfo consumer_info(const Connection& connection, const std::string& version,
                           std::uint32_t lane) {
  jsConsumerInfo* found = nullptr;
  const natsStatus status =
      js_GetConsumerInfo(&found, connection.jetstream(), kJobs,
                         consumer_name(lane_name(version, lane)).c_str(), nullptr, nullptr);
  ConsumerInfo info(found);
  if (status != NATS_NOT_FOUND) require(status, "the workers' consumer");
  return info;
}

Subscription subscribed(const Connection& connection, const std::string& subject) {
  natsSubscription* subscription = nullptr;
  require(natsConnection_SubscribeSync(&subscription, connection.handle(), subject.c_str()),
          subject);
  return Subscription(subscription);
}

/// Null if nothing was told in this time.
Message next_told(const Subscription& told, std::chrono::milliseconds wait) {
  natsMsg* passing = nullptr;
  const natsStatus status = natsSubscription_NextMsg(&passing, told.get(), wait.count());
  Message message(passing);
  // The stream has also what was not kept for want of memory.
  if (status == NATS_TIMEOUT || status == NATS_SLOW_CONSUMER) return nullptr;
  require(status, "what is told");
  return message;
}

std::chrono::milliseconds until(std::chrono::steady_clock::time_point end) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(end -
                                                               std::chrono::steady_clock::now());
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
    told_ = subscribed(connection_, answers());
    set_aside_ = subscribed(connection_, kSetAsideSubject);
    take_off();
  }

  void put_keyframe(const std::string& name, std::span<const std::uint8_t> bytes) override {
    jsPubOptions options;
    require(jsPubOptions_Init(&options), name);
    options.MsgId = name.c_str();
    publish(connection_, kKeyframeSubject + name, bytes.data(), bytes.size(), &options);
  }

  std::uint64_t put_job(const std::string& text, std::uint32_t lane) override {
    const std::string subject =
        kJobSubject + lane_name(names_.version, lane) + "." + names_.project;
    const std::uint64_t number = publish(connection_, subject, text.data(), text.size());
    connection_.publish(kToldSubject + names_.version, "");
    return number;
  }

  bool take_back(std::uint64_t number, std::uint32_t lane) override {
    const ConsumerInfo info = consumer_info(connection_, names_.version, lane);
    // No worker has ever come to a lane that has no consumer. Where jobs before and behind one are
    // gone, nats-server 2.9.10 passes it by and counts it as delivered, though nobody has it.
    if (info != nullptr && info->Delivered.Stream >= number && info->NumAckPending > 0)
      return false;
    // A worker may have taken it just now: then it is verified twice, to the same outcome.
    return js_DeleteMsg(connection_.jetstream(), kJobs, number, nullptr, nullptr) == NATS_OK;
  }

  std::vector<std::uint64_t> set_aside() override {
    std::vector<std::uint64_t> numbers;
    while (const Message told = next_told(set_aside_, kNow)) {
      const auto said = nlohmann::json::parse(data_of(told.get()), nullptr, false);
      const auto number = said.is_object() ? said.find("stream_seq") : said.end();
      if (number == said.end() || !number->is_number_unsigned()) continue;
      numbers.push_back(number->get<std::uint64_t>());
      // The stream would keep it for a day.
      js_DeleteMsg(connection_.jetstream(), kJobs, numbers.back(), nullptr, nullptr);
    }
    return numbers;
  }

  std::optional<std::string> next_answer(std::chrono::milliseconds wait) override {
    const auto end = std::chrono::steady_clock::now() + wait;
    for (;;) {
      if (auto answer = next_kept()) return answer;
      const auto left = until(end);
      if (left.count() <= 0) return std::nullopt;
      // An answer passes by on its way into the stream, where it may be found a little later.
      if (next_told(told_, std::min(left, kToldPoll))) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  }

 private:
  [[nodiscard]] std::string answers() const { return kAnswerSubject + names_.project; }

  /// Jobs of a caller that was killed: who asks again, asks anew.
  void take_off() {
    const std::string own = std::string(kJobSubject) + "*." + names_.project;
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
  Subscription set_aside_;  ///< of jobs that nobody gets any more
  std::uint64_t read_ = 0;  ///< number of the answer that was read last
};

class Source final : public JobSource {
 public:
  Source(const Server& server, std::string version, std::chrono::milliseconds progress)
      : connection_(server),
        version_(std::move(version)),
        progress_(progress),
        lanes_(std::random_device{}()) {
    require_streams(connection_);
    told_ = subscribed(connection_, kToldSubject + version_);
  }

  std::optional<std::string> next_job(std::chrono::milliseconds wait) override {
    const auto end = std::chrono::steady_clock::now() + wait;
    for (;;) {
      const std::map<std::uint32_t, std::uint64_t> jobs = waiting(lanes_with_jobs());
      for (const std::uint32_t lane : lanes_.order(jobs)) {
        if (take(lane, jobs.at(lane) > 0 ? kFetchNs : kGlanceNs)) return data_of(taken_.get());
      }
      const auto left = until(end);
      if (left.count() <= 0) return std::nullopt;
      next_told(told_, std::min(left, kToldPoll));
    }
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
    std::set<std::string> versions;
    for (const Lane& lane : all_lanes()) versions.insert(lane.version);
    return {versions.begin(), versions.end()};
  }

 private:
  struct Lane {
    std::string version;
    std::uint32_t number = 0;
    auto operator<=>(const Lane&) const = default;
  };

  /// Of all versions, those with jobs that wait or are worked at.
  std::set<Lane> all_lanes() {
    jsOptions options;
    require(jsOptions_Init(&options), kJobs);
    options.Stream.Info.SubjectsFilter = "unimapper-job.>";
    jsStreamInfo* found = nullptr;
    const natsStatus status =
        js_GetStreamInfo(&found, connection_.jetstream(), kJobs, &options, nullptr);
    const StreamInfo info(found);
    require(status, kJobs);
    std::set<Lane> lanes;
    const jsStreamStateSubjects* subjects = info->State.Subjects;
    for (int i = 0; subjects != nullptr && i < subjects->Count; ++i) {
      std::string_view name = subjects->List[i].Subject;
      name.remove_prefix(std::string_view(kJobSubject).size());
      name = name.substr(0, name.find('.'));
      const std::size_t dash = std::min(name.rfind('-'), name.size());
      Lane lane{std::string(name.substr(0, dash)), 0};
      const std::string_view digits = name.substr(std::min(dash + 1, name.size()));
      std::from_chars(digits.begin(), digits.end(), lane.number);
      lanes.insert(lane);
    }
    return lanes;
  }

  std::set<std::uint32_t> lanes_with_jobs() {
    std::set<std::uint32_t> own;
    for (const Lane& lane : all_lanes()) {
      if (lane.version == version_ && lane.number < kMostLanes) own.insert(lane.number);
    }
    return own;
  }

  /// How many jobs of each lane nobody has begun. One that may have ended its worker waits in a
  /// lane that has none.
  std::map<std::uint32_t, std::uint64_t> waiting(const std::set<std::uint32_t>& lanes) {
    std::map<std::uint32_t, std::uint64_t> jobs;
    for (const std::uint32_t lane : lanes) {
      const ConsumerInfo info = consumer_info(connection_, version_, lane);
      jobs[lane] = info != nullptr ? info->NumPending : kUntouched;
    }
    return jobs;
  }

  /// False if the lane has no job to give.
  bool take(std::uint32_t lane, std::int64_t wait_ns) {
    jsFetchRequest request;
    require(jsFetchRequest_Init(&request), kJobs);
    request.Batch = 1;
    request.NoWait = true;
    request.Expires = wait_ns;
    natsMsgList list{};
    const natsStatus status = natsSubscription_FetchRequest(&list, jobs_of(lane).get(), &request);
    if (status == NATS_TIMEOUT || status == NATS_NOT_FOUND) return false;
    require(status, "jobs");
    const bool is_taken = list.Count > 0;
    if (is_taken) taken_.reset(std::exchange(list.Msgs[0], nullptr));
    natsMsgList_Destroy(&list);
    if (!is_taken) return false;
    lanes_.take(lane);
    return true;
  }

  const Subscription& jobs_of(std::uint32_t lane) {
    Subscription& jobs = jobs_[lane];
    if (jobs != nullptr) return jobs;
    const std::string in_lane = lane_name(version_, lane);
    require_consumer(connection_, in_lane, progress_);
    jsSubOptions options;
    require(jsSubOptions_Init(&options), kJobs);
    options.Stream = kJobs;
    const std::string name = consumer_name(in_lane);
    options.Consumer = name.c_str();
    natsSubscription* subscription = nullptr;
    const std::string filter = kJobSubject + in_lane + ".*";
    require(js_PullSubscribe(&subscription, connection_.jetstream(), filter.c_str(), name.c_str(),
                             nullptr, &options, nullptr),
            kJobs);
    jobs.reset(subscription);
    return jobs;
  }

  Connection connection_;
  std::string version_;
  std::chrono::milliseconds progress_;
  LaneChoice lanes_;
  Subscription told_;                           ///< that a job was put
  std::map<std::uint32_t, Subscription> jobs_;  ///< by lane
  Message taken_;
};

}  // namespace

std::unique_ptr<JobBoard> open_board(const Server& server, const BoardNames& names) {
  return std::make_unique<Board>(server, names);
}

std::unique_ptr<JobSource> open_source(const Server& server, const std::string& version,
                                       std::chrono::milliseconds progress) {
  return std::make_unique<Source>(server, version, progress);
}

}  // namespace unimapper::nats_port
