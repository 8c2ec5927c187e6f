// Form of LCM addresses.
#include "ports/lcm/address.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <climits>
#include <optional>
#include <string_view>

namespace unimapper::lcm_port {
namespace {

/// A provider of LCM, and all of its options.
struct Provider {
  std::string_view name;
  std::string_view example;
  std::array<std::string_view, 3> options;
};

constexpr std::array<Provider, 3> kProviders = {{
    {"udpm", "udpm://239.255.76.67:7667?ttl=0", {"ttl", "recv_buf_size", "transmit_only"}},
    {"file", "file:///tmp/drive.lcmlog", {"mode", "speed", "start_timestamp"}},
    {"memq", "memq://", {}},
}};

/// The parts of an address: PROVIDER://PLACE?QUERY.
struct Parts {
  std::string_view provider;
  std::string_view place;
  std::string_view query;
};

std::optional<Parts> split(std::string_view url) {
  const std::size_t colon = url.find("://");
  if (colon == std::string_view::npos) return std::nullopt;
  const std::string_view rest = url.substr(colon + 3);
  const std::size_t mark = std::min(rest.find('?'), rest.size());
  return Parts{url.substr(0, colon), rest.substr(0, mark),
               mark < rest.size() ? rest.substr(mark + 1) : std::string_view()};
}

/// A decimal number without leading zeros.
std::optional<unsigned> number(std::string_view text, unsigned most) {
  if (text.size() > 1 && text.front() == '0') return std::nullopt;
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value > most) return std::nullopt;
  return value;
}

/// The first of the four numbers of an IPv4 address.
std::optional<unsigned> first_of_ipv4(std::string_view text) {
  std::optional<unsigned> first;
  for (int i = 0; i < 4; ++i) {
    const std::size_t end = i < 3 ? text.find('.') : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto part = number(text.substr(0, end), 255);
    if (!part) return std::nullopt;
    if (i == 0) first = part;
    text.remove_prefix(i < 3 ? end + 1 : end);
  }
  return first;
}

std::string such_as(const std::string& fault, const Provider& provider) {
  return fault + ", such as " + std::string(provider.example);
}

/// What is wrong with GROUP:PORT.
std::string place_fault(const Provider& udpm, std::string_view place) {
  if (place.empty()) return {};  // LCM's own
  const std::size_t end = std::min(place.find(':'), place.size());
  const auto first = first_of_ipv4(place.substr(0, end));
  if (!first) {
    return such_as("udpm needs the IPv4 address of a multicast group, without leading zeros", udpm);
  }
  if (*first < 224 || *first > 239) {
    return such_as("udpm needs a multicast group, 224.0.0.0 to 239.255.255.255", udpm);
  }
  if (end == place.size()) {
    return such_as("the port is missing: an address has the form udpm://GROUP:PORT", udpm);
  }
  const auto port = number(place.substr(end + 1), 65535);
  if (port && *port > 0) return {};
  return such_as("the port is a number from 1 to 65535 without leading zeros", udpm);
}

/// What is wrong with NAME=VALUE.
std::string option_fault(const Provider& provider, std::string_view option) {
  const std::size_t end = std::min(option.find('='), option.size());
  const std::string_view name = option.substr(0, end);
  const std::string_view value = end < option.size() ? option.substr(end + 1) : std::string_view();
  const auto& known = provider.options;
  if (name.empty() || std::find(known.begin(), known.end(), name) == known.end()) {
    std::string fault =
        std::string(provider.name) + " has no option \"" + std::string(name) + "\", but ";
    for (const std::string_view one : known) {
      if (!one.empty()) fault += std::string(one) + (one == known.back() ? "" : ", ");
    }
    return such_as(fault + (known.front().empty() ? "none" : ""), provider);
  }
  if (name == "ttl" && !number(value, 255)) {
    return such_as("ttl is a number from 0 to 255 without leading zeros", provider);
  }
  if (name == "recv_buf_size" && !number(value, INT_MAX)) {
    return such_as("recv_buf_size is a number of bytes without leading zeros", provider);
  }
  return {};
}

std::string query_fault(const Provider& provider, std::string_view query) {
  while (!query.empty()) {
    const std::size_t end = std::min(query.find_first_of("&,"), query.size());
    std::string fault = option_fault(provider, query.substr(0, end));
    if (!fault.empty()) return fault;
    query.remove_prefix(std::min(end + 1, query.size()));
  }
  return {};
}

bool is_blank(char c) { return static_cast<unsigned char>(c) <= ' '; }

}  // namespace

std::string address_fault(const std::string& url) {
  const auto parts = split(url);
  if (!parts) {
    return such_as("an LCM address begins with udpm://, file:// or memq://", kProviders.front());
  }
  if (parts->provider == "tcpq") {
    return such_as("LCM ends a program that uses tcpq when its server is not there: take udpm",
                   kProviders.front());
  }
  const auto provider =
      std::find_if(kProviders.begin(), kProviders.end(),
                   [&](const Provider& one) { return one.name == parts->provider; });
  if (provider == kProviders.end()) {
    return such_as("LCM knows udpm, file and memq, not \"" + std::string(parts->provider) + "\"",
                   kProviders.front());
  }
  const bool is_file = provider->name == "file";
  if (!is_file && std::any_of(url.begin(), url.end(), is_blank)) {
    return such_as("an LCM address has no blanks", *provider);
  }
  if (provider->name == "udpm") {
    std::string fault = place_fault(*provider, parts->place);
    if (!fault.empty()) return fault;
  }
  return query_fault(*provider, parts->query);
}

}  // namespace unimapper::lcm_port
