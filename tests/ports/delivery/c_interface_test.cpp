// Tests of the delivery's C interface: refusals, status, restarts.
#include <cerrno>

#include "ports/c/unimapper.h"
#include "ports/delivery/c_map_pose.hpp"
#include "ports/delivery/unimapper_delivery.h"
#include "tests/ports/lcm/map_pose.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;

namespace {

/// A network within the process: nobody answers.
constexpr char kNobody[] = "memq://";

um_delivery_options options_of(const char* url, const char* spool) {
  um_delivery_options options;
  REQUIRE(um_delivery_options_init(&options) == 0);
  options.name = "robot7";
  options.url = url;
  options.spool = spool;
  options.robot = 7;
  return options;
}

using Delivery = std::unique_ptr<um_delivery, decltype(&um_delivery_destroy)>;

Delivery make(const um_delivery_options& options) {
  um_delivery* delivery = nullptr;
  char message[256] = "nothing";
  REQUIRE(um_delivery_create(&options, &delivery, message, sizeof message) == 0);
  CHECK(std::string(message).empty());
  return {delivery, &um_delivery_destroy};
}

/// What the refusal says, after its number.
std::string refusal(const um_delivery_options& options, int number) {
  um_delivery* delivery = reinterpret_cast<um_delivery*>(1);
  char message[256] = {};
  CHECK(um_delivery_create(&options, &delivery, message, sizeof message) == number);
  CHECK(delivery == nullptr);
  return message;
}

std::vector<std::uint8_t> keyframe(const um_delivery* delivery, std::uint32_t sequence) {
  SessionId id;
  REQUIRE(um_delivery_session(delivery, &id.robot, &id.boot.high, &id.boot.low) == 0);
  return wire::encode_keyframe(wire::wire_test::keyframe_of(id, sequence));
}

int publish(um_delivery* delivery, const std::vector<std::uint8_t>& bytes) {
  return um_delivery_publish(delivery, bytes.data(), bytes.size(), 1);
}

void publish_four(const Delivery& delivery) {
  for (std::uint32_t i = 0; i < 4; ++i) {
    CHECK(publish(delivery.get(), keyframe(delivery.get(), i)) == 0);
  }
}

um_delivery_status status_of(const um_delivery* delivery) {
  um_delivery_status status = {};
  REQUIRE(um_delivery_status_get(delivery, &status) == 0);
  return status;
}

}  // namespace

TEST_CASE("default options of a delivery lack a name alone") {
  um_delivery_options options;
  REQUIRE(um_delivery_options_init(&options) == 0);
  CHECK(options.datagram_bytes == 60000);
  CHECK(options.bytes_per_second == 20e6);
  CHECK(options.min_bytes_per_second == 4000.0);
  CHECK(options.unacknowledged_bytes == 64000000);
  CHECK(options.spool_bytes == 2000000000);
  CHECK(options.finish_timeout_ms == 30000);
  CHECK(options.spool == nullptr);
  CHECK(options.key == nullptr);
  CHECK(refusal(options, EINVAL).find("name must") == 0);
  options.name = "robot7";
  options.url = kNobody;
  make(options);
}

TEST_CASE("no options are refused") {
  um_delivery_options options = options_of(kNobody, nullptr);
  CHECK(um_delivery_options_init(nullptr) == EINVAL);
  um_delivery* delivery = nullptr;
  char message[8] = "1234567";
  CHECK(um_delivery_create(nullptr, &delivery, message, sizeof message) == EINVAL);
  CHECK(std::string(message) == "options");  // as much as fits
  CHECK(um_delivery_create(&options, nullptr, message, sizeof message) == EINVAL);
  CHECK(um_delivery_create(nullptr, &delivery, nullptr, 0) == EINVAL);
}

TEST_CASE("impossible options of a delivery are refused with a sentence") {
  struct Case {
    const char* sentence;
    void (*change)(um_delivery_options& options);
  };
  const Case cases[] = {
      {"name must", [](auto& o) { o.name = nullptr; }},
      {"name must", [](auto& o) { o.name = "../etc"; }},
      {"sensor must", [](auto& o) { o.sensor = ""; }},
      {"neither a url nor a spool", [](auto& o) { o.url = nullptr; }},
      {"neither a url nor a spool", [](auto& o) { o.url = ""; }},
      {"datagram_bytes", [](auto& o) { o.datagram_bytes = 255; }},
      {"datagram_bytes", [](auto& o) { o.datagram_bytes = 60001; }},
      {"bytes_per_second", [](auto& o) { o.bytes_per_second = 999.0; }},
      {"bytes_per_second", [](auto& o) { o.bytes_per_second = INFINITY; }},
      {"bytes_per_second", [](auto& o) { o.bytes_per_second = std::nan(""); }},
      {"min_bytes_per_second", [](auto& o) { o.min_bytes_per_second = 499.0; }},
      {"min_bytes_per_second", [](auto& o) { o.min_bytes_per_second = 20.1e6; }},
      {"min_bytes_per_second", [](auto& o) { o.min_bytes_per_second = std::nan(""); }},
      {"unacknowledged_bytes", [](auto& o) { o.unacknowledged_bytes = 0; }},
      {"queue_keyframes", [](auto& o) { o.queue_keyframes = 1; }},
      {"queue_keyframes", [](auto& o) { o.queue_keyframes = 65; }},
      {"queue_bytes", [](auto& o) { o.queue_bytes = 999; }},
      {"queue_bytes", [](auto& o) { o.queue_bytes = UINT64_MAX; }},
      {"spool_bytes", [](auto& o) { o.spool = "never-made", o.spool_bytes = 999999; }},
      {"spool_bytes", [](auto& o) { o.spool = "never-made", o.spool_bytes = UINT64_MAX; }},
  };
  for (const Case& one : cases) {
    um_delivery_options options = options_of(kNobody, nullptr);
    one.change(options);
    INFO(one.sentence);
    CHECK(refusal(options, EINVAL).find(one.sentence) == 0);
  }
  CHECK_FALSE(std::filesystem::exists("never-made"));
}

TEST_CASE("a network, a spool or a key that cannot be opened is refused with a sentence") {
  const TemporaryDirectory folder;
  um_delivery_options options = options_of("no-such-network://", nullptr);
  CHECK(refusal(options, ENETUNREACH).find("no-such-network://") != std::string::npos);
  const std::string file = (folder / "file").string();
  std::ofstream(file) << "no folder";
  options = options_of(kNobody, file.c_str());
  CHECK(refusal(options, EIO).find(file) != std::string::npos);
  options = options_of(kNobody, nullptr);
  options.key = file.c_str();
  um_delivery* delivery = nullptr;
  const int number = um_delivery_create(&options, &delivery, nullptr, 0);
  CHECK((number == EACCES || number == ENOTSUP));
  CHECK(delivery == nullptr);
}

TEST_CASE("a start without a number of its own gets a random one") {
  const um_delivery_options options = options_of(kNobody, nullptr);
  SessionId sessions[2];
  for (SessionId& id : sessions) {
    const Delivery delivery = make(options);
    REQUIRE(um_delivery_session(delivery.get(), &id.robot, &id.boot.high, &id.boot.low) == 0);
    CHECK(id.robot == 7);
  }
  CHECK(sessions[0].boot != sessions[1].boot);
  um_delivery_options chosen = options;
  chosen.boot_high = 5;
  chosen.boot_low = 6;
  const Delivery delivery = make(chosen);
  std::uint64_t high = 0;
  REQUIRE(um_delivery_session(delivery.get(), nullptr, &high, nullptr) == 0);
  CHECK(high == 5);
}

TEST_CASE("only keyframes of the session are taken, and none after its end") {
  um_delivery_options options = options_of(kNobody, nullptr);
  options.finish_timeout_ms = 0;
  const Delivery delivery = make(options);
  const Delivery other = make(options);
  auto bytes = keyframe(delivery.get(), 0);
  CHECK(publish(nullptr, bytes) == EINVAL);
  CHECK(um_delivery_publish(delivery.get(), nullptr, 10, 1) == EINVAL);
  CHECK(um_delivery_publish(delivery.get(), bytes.data(), 0, 1) == EPROTO);
  CHECK(um_delivery_publish(delivery.get(), bytes.data(), 31, 1) == EPROTO);
  CHECK(publish(delivery.get(), keyframe(other.get(), 0)) == EPROTO);
  CHECK(publish(delivery.get(), bytes) == 0);
  CHECK(status_of(delivery.get()).published == 1);
  CHECK(um_delivery_finish(delivery.get()) == 0);
  CHECK(um_delivery_finish(delivery.get()) == ESHUTDOWN);
  CHECK(publish(delivery.get(), bytes) == ESHUTDOWN);
  CHECK(status_of(delivery.get()).published == 1);
}

TEST_CASE("calls without a delivery are refused") {
  um_delivery_status status = {};
  um_health health = {};
  CHECK(um_delivery_session(nullptr, nullptr, nullptr, nullptr) == EINVAL);
  CHECK(um_delivery_status_get(nullptr, &status) == EINVAL);
  CHECK(um_delivery_set_health(nullptr, &health) == EINVAL);
  CHECK(um_delivery_finish(nullptr) == EINVAL);
  um_delivery_destroy(nullptr);
  const Delivery delivery = make(options_of(kNobody, nullptr));
  CHECK(um_delivery_status_get(delivery.get(), nullptr) == EINVAL);
  CHECK(um_delivery_set_health(delivery.get(), nullptr) == EINVAL);
  CHECK(um_delivery_set_health(delivery.get(), &health) == 0);
}

TEST_CASE("without a spool the status says that what nobody has is lost at the end") {
  um_delivery_options options = options_of(kNobody, nullptr);
  const Delivery delivery = make(options);
  CHECK(publish(delivery.get(), keyframe(delivery.get(), 0)) == 0);
  CHECK(status_of(delivery.get()).waiting == 1);
  CHECK(um_delivery_finish(delivery.get()) == 0);
  const um_delivery_status status = status_of(delivery.get());
  CHECK(status.published == 1);
  CHECK(status.acknowledged == 0);
  CHECK(status.waiting == 0);
  CHECK(status.lost == 1);
  CHECK(status.base_answers == 0);
  CHECK(status.clock_is_known == 0);
  CHECK(status.has_spool == 0);
  CHECK(status.bytes_per_second == 20e6);
}

TEST_CASE("with a spool it waits for the next start, which knows of it") {
  const TemporaryDirectory folder;
  const std::string spool = (folder / "spool").string();
  // The first start has no network at all.
  um_delivery_options options = options_of(nullptr, spool.c_str());
  {
    const Delivery delivery = make(options);
    publish_four(delivery);
    CHECK(um_delivery_finish(delivery.get()) == 0);
    const um_delivery_status status = status_of(delivery.get());
    CHECK(status.has_spool == 1);
    CHECK(status.spool_failing == 0);
    CHECK(status.spool_keyframes == 4);
    CHECK(status.spool_durable == 4);
    CHECK(status.spool_bytes > 0);
    CHECK(status.waiting == 4);
    CHECK(status.lost == 0);
    CHECK(status.earlier_sessions == 0);
  }
  options.url = kNobody;
  const Delivery delivery = make(options);
  const um_delivery_status status = status_of(delivery.get());
  CHECK(status.earlier_sessions == 1);
  CHECK(status.earlier_keyframes == 4);
  CHECK(status.earlier_acknowledged == 0);
  CHECK(status.published == 0);
}

TEST_CASE("with a queue keyframes take the same way, and those too large for it are refused") {
  const TemporaryDirectory folder;
  const std::string spool = (folder / "spool").string();
  um_delivery_options options = options_of(nullptr, spool.c_str());
  options.queue_keyframes = 8;
  options.queue_bytes = 100000;
  const Delivery delivery = make(options);
  publish_four(delivery);
  auto too_large = keyframe(delivery.get(), 4);
  too_large.resize(100001);
  CHECK(publish(delivery.get(), too_large) == EMSGSIZE);
  CHECK(um_delivery_finish(delivery.get()) == 0);
  CHECK(publish(delivery.get(), keyframe(delivery.get(), 5)) == ESHUTDOWN);
  const um_delivery_status status = status_of(delivery.get());
  CHECK(status.published == 4);
  CHECK(status.refused == 1);
  CHECK(status.spool_durable == 4);
}

TEST_CASE("what is found damaged in the spool is reported in a sentence") {
  const TemporaryDirectory folder;
  const std::string spool = (folder / "spool").string();
  um_delivery_options options = options_of(nullptr, spool.c_str());
  publish_four(make(options));
  for (const auto& entry : std::filesystem::directory_iterator(spool)) {
    if (entry.path().extension() != ".spool") continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(20);  // in the head of the first record
    file.put('?').put('!');
  }
  std::string told;
  options.report_context = &told;
  options.report = [](void* context, const char* sentence) {
    static_cast<std::string*>(context)->append(sentence);
  };
  const Delivery delivery = make(options);
  CHECK(told.find("spool ") == 0);
}

TEST_CASE("as long as no base has said where the robot is, C is told to ask again") {
  const um_delivery_options options = options_of(kNobody, nullptr);
  const Delivery delivery = make(options);
  um_map_pose pose = {};
  pose.epoch = 77;
  CHECK(um_delivery_map_pose(delivery.get(), &pose) == EAGAIN);
  CHECK(pose.epoch == 77);
  CHECK(um_delivery_map_pose(nullptr, &pose) == EINVAL);
  CHECK(um_delivery_map_pose(delivery.get(), nullptr) == EINVAL);
}

TEST_CASE("a place in the map is the same in C, with its age") {
  using namespace std::chrono_literals;
  lcm_port::HeardMapPose heard{lcm_port::lcm_test::map_pose_of({7, {1, 2}}, 3, 42),
                               std::chrono::steady_clock::now() - 5s};
  heard.message.reason = std::string(wire::kMaxMapPoseReasonBytes, 'x');
  const um_map_pose pose =
      delivery::to_c(heard, {.taken = 1, .of_others = 2, .outdated = 3, .malformed = 4});
  CHECK(pose.state == UM_MAP_POSE_LOCALISED);
  CHECK(pose.epoch == 3);
  CHECK(pose.sequence == 42);
  CHECK(pose.loops == 4);
  CHECK(pose.stamp_ns == heard.message.stamp_ns);
  CHECK(pose.position[0] == 100.25);
  CHECK(pose.position[2] == 0.125);
  const Eigen::Quaterniond q(pose.quaternion[3], pose.quaternion[0], pose.quaternion[1],
                             pose.quaternion[2]);
  CHECK(q.toRotationMatrix().isApprox(heard.message.T_map_odometry.rotation, 1e-12));
  CHECK(pose.covariance[0] == heard.message.covariance[0]);
  CHECK(pose.covariance[20] == heard.message.covariance[20]);
  CHECK(pose.since_loop_m == 12.5);
  CHECK(pose.age_ns >= 5000000000);
  CHECK(pose.age_ns < 65000000000);
  CHECK(pose.refused == 7);
  CHECK(std::string(pose.reason) == heard.message.reason);
}
