// Form of LCM addresses.
#include "ports/lcm/address.hpp"

#include <array>
#include <charconv>
#include <optional>
#include <string_view>

namespace unimapper::lcm_port {
namespace {

constexpr std::string_view kExample = "udpm://239.255.76.67:7667?ttl=0";

std::optional<unsigned> number(std::string_view text, unsigned most) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > most) return std::nullopt;
  return value;
}

/// The four numbers of an IPv4 address.
std::optional<std::array<unsigned, 4>> ipv4(std::string_view text) {
  std::array<unsigned, 4> parts{};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? text.find('.') : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto part = number(text.substr(0, end), 255);
    if (!part) return std::nullopt;
    parts[i] = *part;
    text.remove_prefix(i + 1 < parts.size() ? end + 1 : end);
  }
  return parts;
}

std::string such_as(const std::string& fault) {
  return fault + ", such as " + std::string(kExample);
}

}  // namespace

std::string address_fault(const std::string& url) {
  const std::size_t colon = url.find("://");
  if (colon == std::string::npos) {
    return such_as("an LCM address begins with udpm://, tcpq://, file:// or memq://");
  }
  const std::string scheme = url.substr(0, colon);
  if (scheme == "tcpq" || scheme == "file" || scheme == "memq") return {};
  if (scheme != "udpm") {
    return such_as("LCM knows udpm, tcpq, file and memq, not \"" + scheme + "\"");
  }
  const std::string_view rest = std::string_view(url).substr(colon + 3);
  const std::string_view place = rest.substr(0, rest.find('?'));
  if (place.empty()) return {};  // LCM's own group and port
  const std::size_t end = place.find(':');
  const auto group = ipv4(place.substr(0, end));
  if (!group) return such_as("udpm needs the IPv4 address of a multicast group");
  if ((*group)[0] < 224 || (*group)[0] > 239) {
    return such_as("udpm needs a multicast group, 224.0.0.0 to 239.255.255.255");
  }
  if (end == std::string_view::npos) return {};
  const auto port = number(place.substr(end + 1), 65535);
  return port && *port > 0 ? std::string() : such_as("the port is a number from 1 to 65535");
}

}  // namespace unimapper::lcm_port
