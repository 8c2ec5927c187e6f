// Announcement over LCM that something was published in shared memory.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/wire/byte_io.hpp"

namespace lcm {
class LCM;
struct ReceiveBuffer;
}  // namespace lcm

namespace unimapper::lcm_port {

inline constexpr std::string_view kHandleChannel = "UMSHARE";

/// Which message of which topic (`ports/shared_memory`) was published.
struct Handle {
  std::string share;           ///< of the robot
  std::string topic;           ///< of the share
  std::uint32_t sequence = 0;  ///< of the message; a hint
};

/// LCM's encoding. Names have at most 40 characters: std::invalid_argument otherwise.
std::vector<std::uint8_t> encode(const Handle& handle);
/// The handle, or nothing if the bytes are none.
std::optional<Handle> decode_handle(wire::Bytes bytes);

/// Writer's end: tells who waits elsewhere, after each `Writer::publish`. For consumers that live
/// in an LCM loop or where a futex does not wake them (another container's process that maps the
/// same /dev/shm). Not for a real-time thread: it sends a datagram and takes LCM's lock.
class Doorbell {
 public:
  /// `url` as `open_link`'s; only this machine must hear it (ttl=0). Throws LinkError, or
  /// std::invalid_argument for an impossible name.
  Doorbell(const std::string& url, const std::string& share, const std::string& topic);
  /// Announces messages over a link that is open. Throws std::invalid_argument for an impossible
  /// name.
  Doorbell(std::shared_ptr<lcm::LCM> link, const std::string& share, const std::string& topic);

  /// Announces a message. False if the network would not take it.
  bool ring(std::uint32_t sequence);

 private:
  std::shared_ptr<lcm::LCM> link_;
  Handle handle_;
};

/// Consumer's end: waits until a handle of the topic comes, instead of `Reader::wait`. What a
/// handle says is not used but to wake: the consumer then takes what the ring has. So a forged
/// handle costs one look at the ring, and one that is lost delays until the next one or the
/// timeout, after which a consumer looks anyway. Not thread safe.
class DoorbellListener {
 public:
  /// As `Doorbell`.
  DoorbellListener(const std::string& url, const std::string& share, const std::string& topic);
  /// Listens on a link that is open. Throws std::invalid_argument for an impossible name.
  DoorbellListener(std::shared_ptr<lcm::LCM> link, const std::string& share,
                   const std::string& topic);
  ~DoorbellListener();
  DoorbellListener(const DoorbellListener&) = delete;
  DoorbellListener& operator=(const DoorbellListener&) = delete;

  /// True once a handle of the topic has come since the last call; false after the timeout.
  bool wait(std::chrono::milliseconds timeout);
  /// Handles on the channel that were none.
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel);

  std::shared_ptr<lcm::LCM> link_;
  const std::string share_;
  const std::string topic_;
  void* subscription_ = nullptr;  ///< LCM's, which its destructor ends
  bool rung_ = false;
  std::uint64_t malformed_ = 0;
};

}  // namespace unimapper::lcm_port
