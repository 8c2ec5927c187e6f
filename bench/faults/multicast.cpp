#include "bench/faults/multicast.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

namespace unimapper::bench {

namespace {

constexpr int kBufferBytes = 32 << 20;
constexpr std::size_t kLargestDatagram = 65536;

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

template <typename Value>
void set_option(int socket, int level, int name, const Value& value, const char* what) {
  if (setsockopt(socket, level, name, &value, sizeof value) != 0) fail(what);
}

sockaddr_in parse(const std::string& address) {
  const std::size_t colon = address.find(':');
  sockaddr_in group{};
  group.sin_family = AF_INET;
  const std::string host = address.substr(0, colon);
  const int port = colon == std::string::npos ? 0 : std::atoi(address.c_str() + colon + 1);
  if (inet_pton(AF_INET, host.c_str(), &group.sin_addr) != 1 || port < 1 || port > 65535) {
    throw std::runtime_error("\"" + address + "\" is no GROUP:PORT");
  }
  group.sin_port = htons(static_cast<std::uint16_t>(port));
  return group;
}

int open_socket() {
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) fail("socket");
  return descriptor;
}

}  // namespace

MulticastEnd::MulticastEnd(const std::string& address) : group_(parse(address)) {
  listening_ = open_socket();
  sending_ = open_socket();
  listen_to();
  send_from();
}

MulticastEnd::~MulticastEnd() {
  close(listening_);
  close(sending_);
}

void MulticastEnd::listen_to() {
  const int on = 1;
  set_option(listening_, SOL_SOCKET, SO_REUSEADDR, on, "SO_REUSEADDR");
  set_option(listening_, SOL_SOCKET, SO_RXQ_OVFL, on, "SO_RXQ_OVFL");
  // The relay must not lose what it was not told to lose. Beyond the kernel's limit only where
  // that is allowed.
  if (setsockopt(listening_, SOL_SOCKET, SO_RCVBUFFORCE, &kBufferBytes, sizeof kBufferBytes) != 0) {
    set_option(listening_, SOL_SOCKET, SO_RCVBUF, kBufferBytes, "SO_RCVBUF");
  }
  sockaddr_in any = group_;
  any.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(listening_, reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0) fail("bind");
  ip_mreq membership{};
  membership.imr_multiaddr = group_.sin_addr;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  set_option(listening_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership, "IP_ADD_MEMBERSHIP");
}

void MulticastEnd::send_from() {
  const unsigned char ttl = 0;
  set_option(sending_, IPPROTO_IP, IP_MULTICAST_TTL, ttl, "IP_MULTICAST_TTL");
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_ANY);
  socklen_t size = sizeof own;
  if (bind(sending_, reinterpret_cast<const sockaddr*>(&own), size) != 0 ||
      getsockname(sending_, reinterpret_cast<sockaddr*>(&own), &size) != 0) {
    fail("bind");
  }
  own_port_ = own.sin_port;
}

bool MulticastEnd::receive(std::vector<std::uint8_t>& datagram) {
  for (;;) {
    datagram.resize(kLargestDatagram);
    sockaddr_in source{};
    iovec content{datagram.data(), datagram.size()};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(std::uint32_t))];
    msghdr message{};
    message.msg_name = &source;
    message.msg_namelen = sizeof source;
    message.msg_iov = &content;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t bytes = recvmsg(listening_, &message, 0);
    if (bytes < 0) return false;
    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header != nullptr && header->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t count = 0;
      std::memcpy(&count, CMSG_DATA(header), sizeof count);
      overflowed_ = count;
    }
    if (source.sin_port == own_port_) continue;
    datagram.resize(static_cast<std::size_t>(bytes));
    return true;
  }
}

bool MulticastEnd::send(std::span<const std::uint8_t> datagram) {
  return sendto(sending_, datagram.data(), datagram.size(), 0,
                reinterpret_cast<const sockaddr*>(&group_),
                sizeof group_) == static_cast<ssize_t>(datagram.size());
}

}  // namespace unimapper::bench
