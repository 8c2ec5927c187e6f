// LCM link over UDP multicast or any other transport of LCM.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/lcm/datagram_guard.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/lcm/received_log.hpp"
#include "unimapper/wire/keyframe_storage.hpp"

namespace unimapper::lcm_port {

/// LCM would not open. The message holds the URL and what usually helps.
class LinkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A network for `Publisher`, e.g. "udpm://239.255.76.67:7667?ttl=0". With a guard, everything that
/// is sent goes through `seal`, which adds `kEnvelopeBytes` to `PublisherOptions::datagram_bytes`,
/// and only answers that it opens arrive. Throws LinkError.
Link open_link(const std::string& url, std::shared_ptr<DatagramGuard> guard = nullptr);

/// `url` (LCM's default if empty) with a receive buffer of 4 MiB asked for, unless it is no UDP
/// URL or says something else. The kernel's default of 208 KiB holds three datagrams of 60 kB.
std::string with_receive_buffer(const std::string& url);

/// LCM's name of no network: what is sent there reaches nobody.
inline constexpr const char* kNoNetwork = "memq://";

/// What to listen to, and when to stop.
struct ListenOptions {
  /// LCM's name of the network.
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  /// The listening ends when so many have ended. Sessions without a keyframe do not count: it
  /// takes 66 bytes to forge one. 0: it does not end by itself.
  std::size_t sessions_expected = 1;
  /// How long late pieces are waited for when all sessions have ended but some are not whole.
  std::chrono::milliseconds grace{2000};
  /// How long a session may neither say that it is running nor bring a new keyframe before its end
  /// counts, however often that is said; a robot says so once a second.
  std::chrono::milliseconds end_silence{2500};
  ReceiverLimits limits;  ///< what the stream may make the receiver hold
  /// Lets in what is authentic, and seals the answers; null: everything is let in.
  std::shared_ptr<DatagramGuard> guard;
  /// Called ten times a second to hand the receiver what has come by other ways; must not wait. May
  /// be empty.
  std::function<void(Receiver&)> feed;
  /// Asked ten times a second; true ends the listening. May be empty.
  std::function<bool()> stop;
  /// Asked ten times a second for what robots are to be told now of their place in a map; must not
  /// wait. May be empty.
  std::function<std::vector<MapPoseMessage>()> map_poses;
  /// Told in words once messages can arrive, and when something is amiss. May be empty.
  std::function<void(const std::string&)> progress;
  /// Told once a second and at the end where every session stands. May be empty.
  std::function<void(const std::vector<wire::SessionProgress>&, const ReceiverCounters&)> status;
};

/// Listens until the expected sessions have ended, and tells their robots five times a second what
/// `storage` has stored, which takes whole keyframes. Blocks. Stores all that waits before it
/// returns. Throws LinkError if LCM will not open or breaks.
void listen(const ListenOptions& options, wire::KeyframeStorage& storage);

}  // namespace unimapper::lcm_port
