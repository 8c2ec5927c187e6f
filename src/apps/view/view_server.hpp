// HTTP server of a map's page, or of counters alone.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "src/apps/view/view_source.hpp"

namespace unimapper::apps {

/// Where a server listens, and who may change the map.
struct ViewServerOptions {
  std::string address = "127.0.0.1:8080";  ///< HOST:PORT; port 0: any that is free
  std::string token;                       ///< of requests that change the map; empty: none may
  std::string page;                        ///< the page at /
  /// Counters at /metrics, from any thread; null: none.
  std::function<std::string()> metrics{};
};

/// Answers on threads of its own; limits in `view_server.cpp`, interface in docs/api.md.
class ViewServer {
 public:
  /// Listens from then on. `source` must outlive it. Throws std::runtime_error with a sentence for
  /// the user where it cannot.
  ViewServer(const ViewServerOptions& options, ViewSource& source);
  /// Answers /metrics and nothing else, likewise.
  explicit ViewServer(const ViewServerOptions& options);
  /// Ends all connections.
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// "http://HOST:PORT/"; with the token, where there is one, in the fragment.
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  class Routes;
  std::unique_ptr<Routes> routes_;
  std::string url_;
};

/// A token that nobody guesses, 32 hexadecimal digits. Throws std::runtime_error without a source
/// of randomness.
[[nodiscard]] std::string make_token();

}  // namespace unimapper::apps
