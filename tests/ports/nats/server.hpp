// NATS server that a test starts and ends.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <signal.h>  // NOLINT: kill is POSIX
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "ports/nats/connection.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

namespace unimapper::nats_port::nats_test {

/// On a port of its own of this machine, with files of its own.
class TestServer {
 public:
  /// `limits`: lines of its configuration.
  explicit TestServer(const std::string& limits = {}, bool has_streams = true)
      : port_(free_port()), has_streams_(has_streams) {
    start(limits);
  }
  ~TestServer() { kill(); }
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  /// Whether the program is there; says so if not.
  static bool is_installed() {
    const bool is_there = std::system("command -v nats-server >/dev/null") == 0;
    if (!is_there) WARN("skipped: nats-server is not installed");
    return is_there;
  }
  /// `user`: USER:PASSWORD@.
  [[nodiscard]] Server address(const std::string& user = {}) const {
    Server server;
    server.url = "nats://" + user + "127.0.0.1:" + std::to_string(port_);
    return server;
  }
  /// Of its JetStream.
  [[nodiscard]] std::filesystem::path files() const { return folder_ / "jetstream"; }
  /// Returns once it answers.
  void start(const std::string& limits = {}) {
    const std::string port = std::to_string(port_);
    const std::string streams = "jetstream { store_dir: \"" + folder_.path().string() + "\" }\n";
    const std::string config =
        folder_.write("config", (has_streams_ ? streams : std::string()) + limits).string();
    const std::string log = (folder_ / "log").string();
    const char* const arguments[] = {"nats-server", "-c", config.c_str(), "-a",   "127.0.0.1", "-p",
                                     port.c_str(),  "-l", log.c_str(),    nullptr};
    REQUIRE(posix_spawnp(&process_, arguments[0], nullptr, nullptr,
                         const_cast<char* const*>(arguments), environ) == 0);
    for (int tries = 0; !answers(); ++tries) {
      REQUIRE(tries < 200);
      usleep(5000);
    }
  }
  /// Without a chance to write anything, or with SIGTERM with one.
  void kill(int signal = SIGKILL) {
    if (process_ <= 0) return;
    ::kill(process_, signal);
    waitpid(process_, nullptr, 0);
    process_ = 0;
  }
  /// Null if it does not answer, or its JetStream does not.
  [[nodiscard]] std::unique_ptr<Connection> connection() const {
    try {
      auto connection = std::make_unique<Connection>(address());
      connection->require_streams();
      return connection;
    } catch (const NatsError&) {
      return nullptr;
    }
  }

  /// A port that nobody uses now.
  static int free_port() {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(place);
    auto* const generic = reinterpret_cast<sockaddr*>(&place);
    REQUIRE(bind(socket, generic, size) == 0);
    REQUIRE(getsockname(socket, generic, &size) == 0);
    close(socket);
    return ntohs(place.sin_port);
  }

 private:
  [[nodiscard]] bool answers() const {
    if (has_streams_) return connection() != nullptr;
    try {
      return Connection(address()).is_open();
    } catch (const NatsError&) {
      return false;
    }
  }

  TemporaryDirectory folder_;
  int port_;
  bool has_streams_;
  pid_t process_ = 0;
};

}  // namespace unimapper::nats_port::nats_test
