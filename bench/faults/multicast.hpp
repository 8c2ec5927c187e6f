// UDP multicast groups: one socket that listens and one that sends.
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace unimapper::bench {

/// One end of a relay: hears a group on this machine and sends to it. What it sent itself it does
/// not hear.
class MulticastEnd {
 public:
  /// `address`: "239.255.76.67:7667". Throws std::runtime_error.
  explicit MulticastEnd(const std::string& address);
  ~MulticastEnd();
  MulticastEnd(const MulticastEnd&) = delete;
  MulticastEnd& operator=(const MulticastEnd&) = delete;

  /// For poll(2).
  [[nodiscard]] int listening() const { return listening_; }
  /// Takes one datagram that waits. False if none does.
  bool receive(std::vector<std::uint8_t>& datagram);
  /// False if the kernel would not take it.
  bool send(std::span<const std::uint8_t> datagram);
  /// Datagrams for which the kernel's buffer had no room, so far.
  [[nodiscard]] std::uint64_t overflowed() const { return overflowed_; }

 private:
  void listen_to();
  void send_from();

  sockaddr_in group_{};
  std::uint16_t own_port_ = 0;  ///< what this end sends from, network byte order
  int listening_ = -1;
  int sending_ = -1;
  std::uint64_t overflowed_ = 0;
};

}  // namespace unimapper::bench
