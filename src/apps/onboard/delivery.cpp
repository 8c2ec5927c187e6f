#include "src/apps/onboard/delivery.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <utility>

#include "src/apps/map_pose_text.hpp"

namespace unimapper::apps {

namespace {

using Count = unsigned long long;

delivery::DeliveryOptions delivery_options(const OnboardOptions& options,
                                           std::shared_ptr<lcm_port::DatagramGuard> guard) {
  delivery::DeliveryOptions out;
  out.url = options.publish;
  out.guard = std::move(guard);
  // Faster than real time, sending may block; in real time it must not.
  out.publisher.drop_when_full = options.realtime;
  out.publisher.datagram_bytes = options.datagram_bytes;
  out.publisher.bytes_per_second = options.bytes_per_second;
  out.publisher.min_bytes_per_second = options.min_bytes_per_second;
  out.publisher.unacknowledged_bytes = options.unacknowledged_bytes;
  out.spool = options.spool;
  out.spool_limits.bytes = options.spool_bytes;
  out.spool_limits.report = [](const std::string& text) {
    std::fprintf(stderr, "onboard: warning: spool %s\n", text.c_str());
  };
  return out;
}

std::shared_ptr<keys::RobotGuard> make_guard(const OnboardOptions& options, const SessionInfo& info,
                                             const keys::RobotKey* key) {
  if (key == nullptr || options.publish.empty()) return nullptr;
  return std::make_shared<keys::RobotGuard>(*key, info.id.boot);
}

/// What the link was like at the end.
void print_link(const lcm_port::PublisherCounters& own) {
  if (!own.rate_adapts) {
    std::fprintf(stderr, "onboard: sent at up to %.0f kB/s; no base said what arrives\n",
                 own.bytes_per_second * 1e-3);
    return;
  }
  std::fprintf(stderr,
               "onboard: link: %.0f kB/s at the end, %.1f %% of the pieces lost lately, round trip "
               "%.1f ms, window of the base %.0f kB\n",
               own.bytes_per_second * 1e-3, 100.0 * own.loss,
               static_cast<double>(own.round_trip_ns) * 1e-6,
               static_cast<double>(own.window_bytes) * 1e-3);
  if (!own.clock) return;
  std::fprintf(stderr, "onboard: the base's clock is ahead by %.1f ms (within %.1f ms)\n",
               static_cast<double>(own.clock->base_minus_robot_ns) * 1e-6,
               static_cast<double>(own.clock->uncertainty_ns) * 1e-6);
}

/// Where the robot was in the base's map at the end.
void print_map_pose(const std::optional<lcm_port::HeardMapPose>& heard) {
  if (!heard) return;
  const wire::MapPoseMessage& at = heard->message;
  std::fprintf(stderr, "onboard: in the base's map: %s, by keyframe %u\n",
               map_pose_text(at).c_str(), at.sequence);
  if (at.state != wire::MapPoseState::kLocalised) return;
  const std::array<double, 7> p = pose_numbers(at.T_map_odometry);
  std::fprintf(stderr,
               "onboard: the odometry's frame lies there at %.3f %.3f %.3f m, rotation "
               "%.5f %.5f %.5f %.5f (qx qy qz qw)\n",
               p[0], p[1], p[2], p[3], p[4], p[5], p[6]);
}

}  // namespace

Delivery::Delivery(const OnboardOptions& options, const SessionInfo& info,
                   const keys::RobotKey* key)
    : guard_(make_guard(options, info, key)), delivery_(info, delivery_options(options, guard_)) {
  if (options.publish.empty()) return;
  if (options.spool.empty()) {
    std::fprintf(stderr,
                 "onboard: no --spool: what no base acknowledges is sent again from memory (%.0f "
                 "MB) until this process ends\n",
                 static_cast<double>(options.unacknowledged_bytes) * 1e-6);
  }
  const lcm_port::EarlierCounters found = delivery_.counters().earlier;
  if (found.sessions == 0) return;
  std::fprintf(stderr,
               "onboard: the spool holds %llu keyframes of %llu earlier sessions that no base has "
               "confirmed; they are sent too\n",
               static_cast<Count>(found.keyframes), static_cast<Count>(found.sessions));
}

std::string Delivery::map_pose_news() {
  const auto heard = delivery_.map_pose();
  if (!heard) return {};
  const std::pair now{heard->message.epoch, heard->message.state};
  if (std::exchange(told_, now) == now) return {};
  return "in the base's map: " + map_pose_text(heard->message);
}

DeliveryCounters Delivery::finish() {
  DeliveryCounters counters{delivery_.finish(), {}, {}};
  counters.map_pose = delivery_.map_pose();
  // All who used it have finished.
  if (guard_ != nullptr) counters.answers = guard_->counters();
  return counters;
}

void print_delivery(const DeliveryCounters& counters, std::uint64_t keyframes,
                    const OnboardOptions& options) {
  const lcm_port::PublisherCounters& own = counters.own;
  if (counters.published) {
    std::fprintf(stderr,
                 "onboard: %llu of %llu keyframes acknowledged by a base; %llu waiting in the "
                 "spool, %llu sent without an answer, %llu not sent; %llu pieces sent again\n",
                 static_cast<Count>(own.keyframes_acknowledged), static_cast<Count>(keyframes),
                 static_cast<Count>(own.keyframes_waiting),
                 static_cast<Count>(own.keyframes_unacknowledged),
                 static_cast<Count>(own.keyframes_dropped), static_cast<Count>(own.pieces_resent));
    print_link(own);
    print_map_pose(counters.map_pose);
    if (!counters.spooled && own.keyframes_lost() > 0) {
      std::fprintf(stderr, "onboard: without --spool they are not sent again; %s has them all\n",
                   (options.out / "keyframes.lcmlog").c_str());
    }
    if (own.send_failures > 0) {
      std::fprintf(stderr, "onboard: warning: the network refused %llu datagrams\n",
                   static_cast<Count>(own.send_failures));
    }
  }
  if (counters.answers.refused() > 0) {
    std::fprintf(stderr, "onboard: warning: answers refused for their keys: %s\n",
                 keys::describe(counters.answers).c_str());
  }
  if (counters.earlier.sessions > 0) {
    std::fprintf(stderr,
                 "onboard: of earlier sessions %llu of %llu delivered, %llu of %llu keyframes "
                 "acknowledged, %llu lost\n",
                 static_cast<Count>(counters.earlier.sessions_delivered),
                 static_cast<Count>(counters.earlier.sessions),
                 static_cast<Count>(counters.earlier.keyframes_acknowledged),
                 static_cast<Count>(counters.earlier.keyframes),
                 static_cast<Count>(counters.earlier.keyframes_lost));
  }
  if (!counters.spooled) return;
  const spool::SpoolCounters& disk = counters.disk;
  std::fprintf(stderr,
               "onboard: spool %s: %llu keyframes in %.1f MB; %llu of this run written, %llu not "
               "written, %llu removed unacknowledged\n",
               options.spool.c_str(), static_cast<Count>(disk.keyframes_on_disk),
               static_cast<double>(disk.bytes_on_disk) * 1e-6,
               static_cast<Count>(disk.keyframes_durable),
               static_cast<Count>(disk.keyframes_added - disk.keyframes_durable),
               static_cast<Count>(disk.keyframes_lost));
}

}  // namespace unimapper::apps
