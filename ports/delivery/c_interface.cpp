// Delivery for C: unimapper_delivery.h over Delivery.
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "ports/c/unimapper.h"
#include "ports/delivery/authentication.hpp"
#include "ports/delivery/c_health.hpp"
#include "ports/delivery/c_map_pose.hpp"
#include "ports/delivery/c_options.hpp"
#include "ports/delivery/delivery.hpp"
#include "ports/delivery/hand_over.hpp"
#include "ports/delivery/keyframe_head.hpp"
#include "ports/delivery/refusal.hpp"
#include "ports/delivery/unimapper_delivery.h"
#include "ports/lcm/live.hpp"
#include "ports/linux/boot_id.hpp"

using namespace unimapper;
using namespace unimapper::delivery;

/// What the handle points to.
struct um_delivery {
  std::unique_ptr<Authentication> authentication;  ///< null without a key
  std::unique_ptr<Delivery> delivery;
  std::atomic<std::uint64_t> published{0};
  std::atomic<std::uint64_t> handed_on{0};  ///< published keyframes handed to `delivery`
  std::atomic<std::uint64_t> refused{0};    ///< by the full queue
  std::atomic<bool> is_finished{false};
  std::size_t queue_bytes = 0;
  std::unique_ptr<HandOver> queue;  ///< null without one; goes before what it hands to
};

namespace {

/// Runs `call`; whatever it throws becomes a value of errno and a sentence.
template <typename Call>
int guarded(const Call& call, std::string& sentence) noexcept {
  int number = 0;
  const auto tell = [&](int error_number, const char* text) noexcept {
    number = error_number;
    try {
      sentence = text;
    } catch (...) {
      sentence.clear();  // what is left of the memory is not ours
    }
  };
  try {
    call();
  } catch (const Refusal& error) {
    tell(error.number, error.what());
  } catch (const std::bad_alloc&) {
    tell(ENOMEM, "not enough memory");
  } catch (const lcm_port::LinkError& error) {
    tell(ENETUNREACH, error.what());
  } catch (const std::invalid_argument& error) {
    tell(EINVAL, error.what());
  } catch (const std::exception& error) {
    tell(EIO, error.what());
  } catch (...) {
    tell(EIO, "an error of unknown kind");
  }
  return number;
}

void copy_to(char* message, std::size_t message_bytes, std::string_view sentence) noexcept {
  if (message == nullptr || message_bytes == 0) return;
  const std::size_t length = std::min(sentence.size(), message_bytes - 1);
  std::memcpy(message, sentence.data(), length);
  message[length] = '\0';
}

SessionId session_of(const um_delivery_options& options, const Authentication* key) {
  SessionId session{options.robot, {options.boot_high, options.boot_low}};
  if (session.boot == BootId()) session.boot = linux_port::random_boot();
  if (key == nullptr) return session;
  if (session.robot != 0 && session.robot != key->robot()) {
    throw Refusal(EINVAL, "robot is " + std::to_string(session.robot) +
                              ", but the key is that of " + std::to_string(key->robot()));
  }
  session.robot = key->robot();
  return session;
}

/// Signs, spools and sends.
void deliver(um_delivery& delivery, wire::Bytes bytes, std::int64_t stamp_ns) {
  const auto head = read_head(bytes);
  wire::EncodedKeyframe keyframe{
      head->session, head->sequence, stamp_ns, {bytes.begin(), bytes.end()}};
  if (delivery.authentication) delivery.authentication->sign(keyframe.bytes);
  delivery.delivery->publish(std::move(keyframe));
  ++delivery.handed_on;
}

/// 0, or why the keyframe is not published, as a value of errno.
int publish(um_delivery& delivery, wire::Bytes bytes, std::int64_t stamp_ns) {
  if (delivery.is_finished) return ESHUTDOWN;
  const auto head = read_head(bytes);
  if (!head || head->session != delivery.delivery->info().id) return EPROTO;
  if (delivery.queue == nullptr) {
    std::string sentence;
    const int number = guarded([&] { deliver(delivery, bytes, stamp_ns); }, sentence);
    delivery.published += number == 0 ? 1 : 0;
    return number;
  }
  if (!delivery.queue->put(bytes, stamp_ns)) {
    ++delivery.refused;
    return bytes.size() > delivery.queue_bytes ? EMSGSIZE : ENOBUFS;
  }
  ++delivery.published;
  return 0;
}

std::unique_ptr<um_delivery> create(const um_delivery_options& options) {
  check(options);
  auto made = std::make_unique<um_delivery>();
  const std::string key = text_of(options.key);
  if (!key.empty()) made->authentication = read_authentication(key);
  const SessionInfo info{session_of(options, made->authentication.get()), options.name,
                         options.sensor};
  DeliveryOptions chosen = to_cpp(options);
  if (made->authentication) chosen.guard = made->authentication->guard(info.id.boot);
  made->delivery = std::make_unique<Delivery>(info, std::move(chosen));
  if (options.queue_keyframes == 0) return made;
  made->queue_bytes = static_cast<std::size_t>(options.queue_bytes);
  made->queue =
      std::make_unique<HandOver>(options.queue_keyframes, made->queue_bytes,
                                 [to = made.get()](wire::Bytes bytes, std::int64_t stamp_ns) {
                                   deliver(*to, bytes, stamp_ns);
                                 });
  return made;
}

void fill_in_link(const lcm_port::PublisherCounters& own, um_delivery_status& status) {
  status.base_answers = own.base_answers ? 1 : 0;
  status.rate_adapts = own.rate_adapts ? 1 : 0;
  status.end_is_known = own.end_confirmed ? 1 : 0;
  status.acknowledged = own.keyframes_acknowledged;
  status.waiting = own.keyframes_waiting;
  status.sent = own.keyframes_sent;
  status.dropped = own.keyframes_dropped;
  status.lost = own.keyframes_lost();
  status.pieces_resent = own.pieces_resent;
  status.bytes_sent = own.bytes_sent;
  status.send_failures = own.send_failures;
  status.bytes_per_second = own.bytes_per_second;
  status.loss = own.loss;
  status.round_trip_ns = own.round_trip_ns;
  status.window_bytes = own.window_bytes;
  if (!own.clock) return;
  status.clock_is_known = 1;
  status.clock_offset_ns = own.clock->base_minus_robot_ns;
  status.clock_uncertainty_ns = own.clock->uncertainty_ns;
}

void fill_in_spool(const DeliveryCounters& counters, um_delivery_status& status) {
  const spool::SpoolCounters& disk = counters.disk;
  status.has_spool = 1;
  status.spool_failing = disk.failing ? 1 : 0;
  status.spool_bytes = disk.bytes_on_disk;
  status.spool_keyframes = disk.keyframes_on_disk;
  status.spool_durable = disk.keyframes_durable;
  status.spool_refused = disk.keyframes_refused;
  status.spool_lost = disk.keyframes_lost;
  status.spool_damaged = disk.keyframes_damaged;
  status.earlier_sessions = counters.earlier.sessions;
  status.earlier_delivered = counters.earlier.sessions_delivered;
  status.earlier_keyframes = counters.earlier.keyframes;
  status.earlier_acknowledged = counters.earlier.keyframes_acknowledged;
  status.earlier_lost = counters.earlier.keyframes_lost;
  if (counters.published) return;
  // Nobody but the disk has them.
  status.waiting = disk.keyframes_added - disk.keyframes_refused;
  status.lost = disk.keyframes_refused;
}

/// What waits for the library's thread, and what that could not take.
void fill_in_queue(const um_delivery& delivery, std::uint64_t handed_on,
                   um_delivery_status& status) {
  status.published = delivery.published;
  const std::uint64_t failed = delivery.queue != nullptr ? delivery.queue->failed() : 0;
  status.lost += failed;
  status.waiting += status.published - std::min(status.published, handed_on + failed);
}

}  // namespace

int um_delivery_create(const um_delivery_options* options, um_delivery** delivery, char* message,
                       size_t message_bytes) {
  std::string sentence;
  const int number = guarded(
      [&] {
        if (delivery == nullptr) throw Refusal(EINVAL, "delivery is null");
        *delivery = nullptr;
        if (options == nullptr) throw Refusal(EINVAL, "options is null");
        *delivery = create(*options).release();
      },
      sentence);
  copy_to(message, message_bytes, sentence);
  return number;
}

int um_delivery_session(const um_delivery* delivery, uint32_t* robot, uint64_t* boot_high,
                        uint64_t* boot_low) {
  if (delivery == nullptr) return EINVAL;
  const SessionId& session = delivery->delivery->info().id;
  if (robot != nullptr) *robot = session.robot;
  if (boot_high != nullptr) *boot_high = session.boot.high;
  if (boot_low != nullptr) *boot_low = session.boot.low;
  return 0;
}

int um_delivery_publish(um_delivery* delivery, const void* bytes, size_t size, int64_t stamp_ns) {
  if (delivery == nullptr || bytes == nullptr) return EINVAL;
  return publish(*delivery, wire::Bytes(static_cast<const std::uint8_t*>(bytes), size), stamp_ns);
}

int um_delivery_set_health(um_delivery* delivery, const um_health* health) {
  if (delivery == nullptr || health == nullptr) return EINVAL;
  std::string sentence;
  return guarded([&] { delivery->delivery->set_health(to_message(*health)); }, sentence);
}

int um_delivery_status_get(const um_delivery* delivery, um_delivery_status* status) {
  if (delivery == nullptr || status == nullptr) return EINVAL;
  std::string sentence;
  return guarded(
      [&] {
        // In this order: what is handed on meanwhile waits twice rather than nowhere.
        const std::uint64_t handed_on = delivery->handed_on;
        const DeliveryCounters counters = delivery->delivery->counters();
        *status = {};
        status->refused = delivery->refused;
        if (delivery->authentication) status->answers_refused = delivery->authentication->refused();
        if (counters.published) fill_in_link(counters.own, *status);
        if (counters.spooled) fill_in_spool(counters, *status);
        fill_in_queue(*delivery, handed_on, *status);
      },
      sentence);
}

int um_delivery_map_pose(const um_delivery* delivery, um_map_pose* pose) {
  if (delivery == nullptr || pose == nullptr) return EINVAL;
  std::string sentence;
  bool is_known = false;
  const int error = guarded(
      [&] {
        const auto heard = delivery->delivery->map_pose();
        is_known = heard.has_value();
        if (is_known) *pose = to_c(*heard, delivery->delivery->counters().own.map_poses);
      },
      sentence);
  return error != 0 || is_known ? error : EAGAIN;
}

int um_delivery_finish(um_delivery* delivery) {
  if (delivery == nullptr) return EINVAL;
  if (delivery->is_finished.exchange(true)) return ESHUTDOWN;
  std::string sentence;
  return guarded(
      [&] {
        if (delivery->queue) delivery->queue->finish();
        (void)delivery->delivery->finish();
      },
      sentence);
}

void um_delivery_destroy(um_delivery* delivery) { delete delivery; }
