#include "ports/nats/server.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string_view>

namespace unimapper::nats_port {

namespace {

/// SCHEME://[USER@]HOST[:PORT].
struct Parts {
  std::string_view scheme;
  std::string_view user;
  std::string_view host;
  std::string_view place;  ///< HOST[:PORT]
};

Parts split(std::string_view address) {
  const std::size_t end = address.find("://");
  if (end == std::string_view::npos) return {};
  Parts parts{address.substr(0, end), {}, {}, address.substr(end + 3)};
  if (const std::size_t at = parts.place.rfind('@'); at != std::string_view::npos) {
    parts.user = parts.place.substr(0, at);
    parts.place.remove_prefix(at + 1);
  }
  const bool is_bracketed = parts.place.substr(0, 1) == "[";
  parts.host = is_bracketed ? parts.place.substr(0, parts.place.find(']') + 1)
                            : parts.place.substr(0, parts.place.find(':'));
  return parts;
}

/// Names of other machines may begin with 127, addresses may not.
bool is_loopback(std::string_view host) {
  if (host == "localhost" || host == "[::1]") return true;
  return host.substr(0, 4) == "127." &&
         host.find_first_not_of("0123456789.") == std::string_view::npos;
}

void check_address(const std::string& address, bool has_file, bool has_password) {
  const Parts parts = split(address);
  const bool is_tls = parts.scheme == "tls";
  if ((!is_tls && parts.scheme != "nats") || parts.host.empty()) {
    throw NatsError("an address of NATS is nats://HOST:PORT or tls://HOST:PORT");
  }
  if (is_loopback(parts.host)) return;
  const std::string host(parts.host);
  if (!has_file && parts.user.empty()) {
    throw NatsError(host +
                    " is another machine: without credentials only servers on this one are "
                    "taken (--nats-credentials, or tls://USER:PASSWORD@" +
                    host + ")");
  }
  if ((has_password || !parts.user.empty()) && !is_tls) {
    throw NatsError("a password would go to " + host + " in the clear: tls:// is needed");
  }
}

}  // namespace

std::vector<std::string> addresses(const Server& server) {
  std::vector<std::string> all;
  for (std::size_t begin = 0; begin <= server.url.size();) {
    const std::size_t end = std::min(server.url.find(',', begin), server.url.size());
    all.push_back(server.url.substr(begin, end - begin));
    begin = end + 1;
  }
  return all;
}

std::string shown(const Server& server) {
  std::string text;
  for (const std::string& address : addresses(server)) {
    const Parts parts = split(address);
    text +=
        (text.empty() ? "" : ",") + std::string(parts.scheme) + "://" + std::string(parts.place);
  }
  return text;
}

std::string user_of(const Server& server) {
  const std::string first = addresses(server).front();
  const std::string_view user = split(first).user;
  return std::string(user.substr(0, user.find(':')));
}

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw NatsError(file.string() + ": cannot be read");
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
    if (!line.empty() && std::isalnum(static_cast<unsigned char>(line[0]))) lines.push_back(line);
  }
  return lines;
}

std::optional<std::pair<std::string, std::string>> password_of(const std::filesystem::path& file) {
  if (file.empty()) return std::nullopt;
  const std::vector<std::string> lines = lines_of(file);
  const std::size_t colon = lines.size() == 1 ? lines[0].find(':') : std::string::npos;
  if (colon == std::string::npos) return std::nullopt;
  return std::pair(lines[0].substr(0, colon), lines[0].substr(colon + 1));
}

void check(const Server& server) {
  for (const std::filesystem::path& file :
       {server.credentials, server.ca, server.certificate, server.key}) {
    if (!file.empty()) (void)lines_of(file);
  }
  if (server.certificate.empty() != server.key.empty()) {
    throw NatsError("a certificate goes with its key (--nats-certificate, --nats-key)");
  }
  const bool has_file = !server.credentials.empty() || !server.certificate.empty();
  const bool has_password = password_of(server.credentials).has_value();
  for (const std::string& address : addresses(server)) {
    check_address(address, has_file, has_password);
  }
}

}  // namespace unimapper::nats_port
