#include "src/apps/onboard/delivery.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <utility>

#include "src/apps/map_pose_text.hpp"
#include "src/apps/print.hpp"

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
    print_to(stderr, "onboard: warning: spool {}\n", text);
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
    print_to(stderr, "onboard: sent at up to {:.0f} kB/s; no base said what arrives\n",
             own.bytes_per_second * 1e-3);
    return;
  }
  print_to(stderr,
           "onboard: link: {:.0f} kB/s at the end, {:.1f} % of the pieces lost lately, round "
           "trip {:.1f} ms, window of the base {:.0f} kB\n",
           own.bytes_per_second * 1e-3, 100.0 * own.loss,
           static_cast<double>(own.round_trip_ns) * 1e-6,
           static_cast<double>(own.window_bytes) * 1e-3);
  if (!own.clock) return;
  print_to(stderr, "onboard: the base's clock is ahead by {:.1f} ms (within {:.1f} ms)\n",
           static_cast<double>(own.clock->base_minus_robot_ns) * 1e-6,
           static_cast<double>(own.clock->uncertainty_ns) * 1e-6);
}

/// Where the robot was in the base's map at the end.
void print_map_pose(const std::optional<lcm_port::HeardMapPose>& heard) {
  if (!heard) return;
  const wire::MapPoseMessage& at = heard->message;
  print_to(stderr, "onboard: in the base's map: {}, by keyframe {}\n", map_pose_text(at),
           at.sequence);
  if (at.state != wire::MapPoseState::kLocalised) return;
  const std::array<double, 7> p = pose_numbers(at.T_map_odometry);
  print_to(stderr,
           "onboard: the odometry's frame lies there at {:.3f} {:.3f} {:.3f} m, rotation {:.5f} "
           "{:.5f} {:.5f} {:.5f} (qx qy qz qw)\n",
           p[0], p[1], p[2], p[3], p[4], p[5], p[6]);
}

}  // namespace

Delivery::Delivery(const OnboardOptions& options, const SessionInfo& info,
                   const keys::RobotKey* key)
    : guard_(make_guard(options, info, key)), delivery_(info, delivery_options(options, guard_)) {
  if (options.publish.empty()) return;
  if (options.spool.empty()) {
    print_to(stderr,
             "onboard: no --spool: what no base acknowledges is sent again from memory ({:.0f} "
             "MB) until this process ends\n",
             static_cast<double>(options.unacknowledged_bytes) * 1e-6);
  }
  const lcm_port::EarlierCounters found = delivery_.counters().earlier;
  if (found.sessions == 0) return;
  print_to(stderr,
           "onboard: the spool holds {} keyframes of {} earlier sessions that no base has "
           "confirmed; they are sent too\n",
           found.keyframes, found.sessions);
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
    print_to(stderr,
             "onboard: {} of {} keyframes acknowledged by a base; {} waiting in the spool, {} "
             "sent without an answer, {} not sent; {} pieces sent again\n",
             own.keyframes_acknowledged, keyframes, own.keyframes_waiting,
             own.keyframes_unacknowledged, own.keyframes_dropped, own.pieces_resent);
    print_link(own);
    print_map_pose(counters.map_pose);
    if (!counters.spooled && own.keyframes_lost() > 0) {
      print_to(stderr, "onboard: without --spool they are not sent again; {} has them all\n",
               (options.out / "keyframes.lcmlog").c_str());
    }
    if (own.send_failures > 0) {
      print_to(stderr, "onboard: warning: the network refused {} datagrams\n", own.send_failures);
    }
  }
  if (counters.answers.refused() > 0) {
    print_to(stderr, "onboard: warning: answers refused for their keys: {}\n",
             keys::describe(counters.answers));
  }
  if (counters.earlier.sessions > 0) {
    print_to(stderr,
             "onboard: of earlier sessions {} of {} delivered, {} of {} keyframes acknowledged, "
             "{} lost\n",
             counters.earlier.sessions_delivered, counters.earlier.sessions,
             counters.earlier.keyframes_acknowledged, counters.earlier.keyframes,
             counters.earlier.keyframes_lost);
  }
  if (!counters.spooled) return;
  const spool::SpoolCounters& disk = counters.disk;
  print_to(stderr,
           "onboard: spool {}: {} keyframes in {:.1f} MB; {} of this run written, {} not "
           "written, {} removed unacknowledged\n",
           options.spool.c_str(), disk.keyframes_on_disk,
           static_cast<double>(disk.bytes_on_disk) * 1e-6, disk.keyframes_durable,
           disk.keyframes_added - disk.keyframes_durable, disk.keyframes_lost);
}

}  // namespace unimapper::apps
