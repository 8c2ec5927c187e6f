// Addresses of NATS servers, and how a program shows who it is.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace unimapper::nats_port {

/// What NATS or its server refuses, or cannot do now, in words.
class NatsError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A server, or the servers of one cluster.
struct Server {
  std::string url;  ///< nats:// or tls://, [USER:PASSWORD@]HOST[:PORT]; several with commas
  /// File with USER:PASSWORD, with the seed and the public key of an NKEY, a line each, or a .creds
  /// file. Empty: none.
  std::filesystem::path credentials;
  std::filesystem::path ca;           ///< certificates that the server's must come from
  std::filesystem::path certificate;  ///< of this program, with `key`
  std::filesystem::path key;          ///< secret key of `certificate`
};

/// The addresses one by one.
std::vector<std::string> addresses(const Server& server);
/// All of them without passwords, for people.
std::string shown(const Server& server);
/// The user that the first address names, or nothing.
std::string user_of(const Server& server);
/// Throws NatsError for what is no address, for a server beyond this machine without credentials or
/// with a password in the clear, and for a file that cannot be read.
void check(const Server& server);
/// The lines of a file that begin with a letter or a digit, without blanks at their end. Throws
/// NatsError if it cannot be read.
std::vector<std::string> lines_of(const std::filesystem::path& file);
/// User and password if they are what the file holds. Throws NatsError if it cannot be read.
std::optional<std::pair<std::string, std::string>> password_of(const std::filesystem::path& file);

}  // namespace unimapper::nats_port
