#include "src/apps/view/view_server.hpp"

#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

// Each connection that is serving has a thread; one that follows events has it for long.
constexpr std::size_t kThreads = 64;
constexpr std::size_t kThreadsAlone = 4;
constexpr int kMostFollowers = 32;
constexpr std::size_t kMaxRequestBytes = 64U << 10U;
constexpr std::size_t kRequestsPerConnection = 100;
constexpr std::chrono::seconds kReadTimeout{5};
constexpr std::chrono::seconds kWriteTimeout{10};
constexpr std::chrono::seconds kIdle{5};
/// A comment, so that a client that has gone is found out.
constexpr std::chrono::milliseconds kBeat{2000};

constexpr const char* kJsonType = "application/json";
constexpr const char* kForever = "public, max-age=31536000, immutable";

/// Whether two texts are equal; the time it takes gives no hint how much of one is right.
bool is_equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned differing = 0;
  for (std::size_t i = 0; i < a.size(); ++i) differing |= static_cast<unsigned>(a[i] ^ b[i]);
  return differing == 0;
}

void refuse(httplib::Response& response, int status, const std::string& why) {
  response.status = status;
  response.set_content(Json{{"error", why}}.dump(), kJsonType);
}

template <typename Number>
std::optional<Number> number(const std::string& text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return value;
}

std::optional<LoopStatement> statement_of(const Json& json) {
  if (!json.is_string()) return std::nullopt;
  const auto& text = json.get_ref<const std::string&>();
  if (text == "right") return LoopStatement::kRight;
  if (text == "wrong") return LoopStatement::kWrong;
  if (text == "not yet") return LoopStatement::kNotYet;
  return std::nullopt;
}

std::optional<NamedLoop> loop_of(const Json& body) {
  const Json query = body.value("query", Json());
  const Json match = body.value("match", Json());
  if (!query.is_string() || !match.is_string()) return std::nullopt;
  return NamedLoop{query.get<std::string>(), match.get<std::string>()};
}

/// The body of a request to change the map; null if it is none.
Json body_of(const httplib::Request& request) {
  Json json = Json::parse(request.body, nullptr, false);
  if (!json.is_object() || !json.contains("epoch") || !json["epoch"].is_number_integer()) {
    return nullptr;
  }
  return json;
}

/// Points, as they are stored; a browser undoes the compression.
void send_points(const std::optional<std::string>& block, httplib::Response& response) {
  if (!block) return refuse(response, 404, "there are no such points");
  response.set_header("Content-Encoding", "gzip");
  response.set_header("Cache-Control", kForever);
  response.set_content(*block, "application/octet-stream");
}

}  // namespace

class ViewServer::Routes {
 public:
  /// `source` null: counters alone.
  Routes(const ViewServerOptions& options, ViewSource* source)
      : options_(options), source_(source) {
    limit();
    answer_metrics();
    if (source_ != nullptr) {
      answer_pages();
      answer_points();
      answer_events();
      answer_changes();
    }
    bind();
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    // A server that does not run yet could not be stopped.
    while (!server_.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  ~Routes() {
    if (source_ != nullptr) source_->events().close();
    server_.stop();
    thread_.join();
  }
  Routes(const Routes&) = delete;
  Routes& operator=(const Routes&) = delete;

  [[nodiscard]] std::string url() const {
    return "http://" + at_.host + ":" + std::to_string(at_.port) + "/" +
           (options_.token.empty() ? "" : "#token=" + options_.token);
  }

 private:
  struct HostAndPort {
    std::string host;
    int port = 0;
  };

  static HostAndPort parsed(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    HostAndPort at;
    if (colon != std::string::npos && colon > 0) {
      at.host = address.substr(0, colon);
      const char* end = address.data() + address.size();
      const auto read = std::from_chars(address.data() + colon + 1, end, at.port);
      if (read.ec == std::errc() && read.ptr == end && at.port >= 0 && at.port < 65536) return at;
    }
    throw std::runtime_error(address + " is no address: HOST:PORT is expected, as 127.0.0.1:8080");
  }

  void limit() {
    const std::size_t threads = source_ != nullptr ? kThreads : kThreadsAlone;
    server_.new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
    server_.set_payload_max_length(kMaxRequestBytes);
    server_.set_keep_alive_max_count(kRequestsPerConnection);
    server_.set_keep_alive_timeout(kIdle.count());
    server_.set_read_timeout(kReadTimeout);
    server_.set_write_timeout(kWriteTimeout);
    server_.set_tcp_nodelay(true);
    // The library's own options would let two programs share the port.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server_.set_default_headers({
        {"X-Content-Type-Options", "nosniff"},
        {"Referrer-Policy", "no-referrer"},
        {"Content-Security-Policy",
         "default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; "
         "style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; "
         "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"},
    });
    server_.set_exception_handler(
        [](const httplib::Request&, httplib::Response& response, const std::exception_ptr& thrown) {
          try {
            std::rethrow_exception(thrown);
          } catch (const std::exception& error) {
            refuse(response, 500, error.what());
          } catch (...) {
            refuse(response, 500, "it failed without a reason");
          }
        });
    server_.set_error_handler([](const httplib::Request&, httplib::Response& response) {
      if (response.body.empty()) refuse(response, response.status, "there is nothing here");
    });
  }

  void answer_pages() {
    server_.Get("/", [this](const httplib::Request&, httplib::Response& response) {
      response.set_content(options_.page, "text/html; charset=utf-8");
    });
    server_.Get("/api/map", [this](const httplib::Request& request, httplib::Response& response) {
      const auto epoch =
          number<std::int64_t>(request.has_param("epoch") ? request.get_param_value("epoch") : "0");
      if (!epoch || *epoch < 0) return refuse(response, 400, "an epoch is a number");
      response.set_header("Cache-Control", "no-store");
      response.set_content(*source_->map_json(*epoch), kJsonType);
    });
    server_.Get("/api/health", [this](const httplib::Request&, httplib::Response& response) {
      response.set_header("Cache-Control", "no-store");
      response.set_content(source_->health_json(), kJsonType);
    });
  }

  void answer_metrics() {
    if (!options_.metrics) return;
    server_.Get("/metrics", [this](const httplib::Request&, httplib::Response& response) {
      response.set_header("Cache-Control", "no-store");
      response.set_content(options_.metrics(), "text/plain; version=0.0.4");
    });
  }

  void answer_points() {
    server_.Get(R"(/api/tiles/([0-9.]{1,40})/([a-z_]{1,20})/(r[0-7]{0,30}))",
                [this](const httplib::Request& request, httplib::Response& response) {
                  send_points(
                      source_->block(request.matches[1], request.matches[2], request.matches[3]),
                      response);
                });
    server_.Get(R"(/api/keyframes/([0-9.]{1,40})/([0-9]{1,9})/([0-9]{1,9}))",
                [this](const httplib::Request& request, httplib::Response& response) {
                  send_points(
                      source_->keyframe(request.matches[1],
                                        number<std::size_t>(request.matches[2]).value_or(0),
                                        number<std::size_t>(request.matches[3]).value_or(0)),
                      response);
                });
  }

  void answer_events() {
    server_.Get("/api/events", [this](const httplib::Request& request,
                                      httplib::Response& response) {
      if (followers_.fetch_add(1) >= kMostFollowers) {
        --followers_;
        return refuse(response, 503, "too many pages follow this map");
      }
      const auto last = number<std::uint64_t>(request.get_header_value("Last-Event-ID"));
      const auto seen = std::make_shared<std::uint64_t>(
          std::min(last.value_or(source_->events().latest()), source_->events().latest()));
      response.set_header("Cache-Control", "no-store");
      response.set_chunked_content_provider(
          "text/event-stream",
          [this, seen](std::size_t, httplib::DataSink& sink) { return send_events(*seen, sink); },
          [this](bool) { --followers_; });
    });
  }

  bool send_events(std::uint64_t& seen, httplib::DataSink& sink) {
    if (source_->events().is_closed()) {
      sink.done();
      return true;
    }
    bool missed = false;
    std::string text = source_->events().after(seen, kBeat, missed);
    // What a client has missed, the map has.
    if (missed) text = "event: map\ndata: {}\n\n" + text;
    if (text.empty()) text = ": still here\n\n";
    return sink.write(text.data(), text.size());
  }

  void answer_changes() {
    server_.Post("/api/loops/statement", [this](const httplib::Request& request,
                                                httplib::Response& response) {
      const Json body = changing_body(request, response);
      if (body.is_null()) return;
      const auto statement = statement_of(body.value("statement", Json()));
      if (!statement) {
        return refuse(response, 400, R"(a statement is "right", "wrong" or "not yet")");
      }
      const std::optional<NamedLoop> loop = loop_of(body);
      if (!loop) return refuse(response, 400, "query and match name a keyframe each, in words");
      send(source_->decide(*loop, *statement, body["epoch"].get<std::int64_t>()), response);
    });
    server_.Post("/api/undo", [this](const httplib::Request& request, httplib::Response& response) {
      const Json body = changing_body(request, response);
      if (body.is_null()) return;
      send(source_->undo(body["epoch"].get<std::int64_t>()), response);
    });
  }

  /// The body of a request by somebody who may change the map; null where it was refused.
  [[nodiscard]] Json changing_body(const httplib::Request& request,
                                   httplib::Response& response) const {
    const bool may = !options_.token.empty() && is_equal(request.get_header_value("Authorization"),
                                                         "Bearer " + options_.token);
    if (!may) {
      refuse(response, 401, "only who knows the token may change the map");
      return nullptr;
    }
    Json body = body_of(request);
    if (body.is_null()) refuse(response, 400, "the request names no epoch in JSON");
    return body;
  }

  static void send(const ViewAnswer& answer, httplib::Response& response) {
    response.status = answer.status;
    response.set_content(answer.message, kJsonType);
  }

  void bind() {
    at_ = parsed(options_.address);
    const bool any = at_.port == 0;
    if (any) {
      at_.port = server_.bind_to_any_port(at_.host);
    } else if (!server_.bind_to_port(at_.host, at_.port)) {
      at_.port = -1;
    }
    if (at_.port < 0) {
      throw std::runtime_error("cannot listen at " + options_.address +
                               ": another program does, or it is no address of this machine");
    }
  }

  ViewServerOptions options_;
  ViewSource* source_;
  HostAndPort at_;
  std::atomic<int> followers_{0};
  httplib::Server server_;
  std::thread thread_;
};

ViewServer::ViewServer(const ViewServerOptions& options, ViewSource& source)
    : routes_(std::make_unique<Routes>(options, &source)), url_(routes_->url()) {}

ViewServer::ViewServer(const ViewServerOptions& options)
    : routes_(std::make_unique<Routes>(options, nullptr)), url_(routes_->url()) {}

ViewServer::~ViewServer() = default;

std::string make_token() {
  std::ifstream random("/dev/urandom", std::ios::binary);
  unsigned char bytes[16];
  random.read(reinterpret_cast<char*>(bytes), sizeof bytes);
  if (!random) throw std::runtime_error("/dev/urandom: cannot be read");
  std::string token;
  for (const unsigned char byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    token += kDigits[byte >> 4U];
    token += kDigits[byte & 15U];
  }
  return token;
}

}  // namespace unimapper::apps
