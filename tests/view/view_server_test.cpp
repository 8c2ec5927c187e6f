// Tests of the server of the page: what it answers, and what it withstands.
#include "src/apps/view/view_server.hpp"

#include <arpa/inet.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "tests/test.hpp"

using namespace unimapper::apps;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

/// More than sockets take for a client that does not read.
constexpr std::size_t kLargeBlock = 30'000'000;

/// A map of a small and a large block, which remembers what it was asked to change.
class OneBlock : public ViewSource {
 public:
  std::shared_ptr<const std::string> map_json(std::int64_t epoch) override {
    asked = std::to_string(epoch);
    if (fails) throw std::runtime_error("the store is gone");
    return std::make_shared<const std::string>(R"({"format":1})");
  }
  std::optional<std::string> block(const std::string& version, const std::string& layer,
                                   const std::string& key) override {
    asked = version + " " + layer + " " + key;
    if (key == "r7") return std::string(kLargeBlock, 'x');
    return key == "r" ? std::optional<std::string>("points") : std::nullopt;
  }
  std::optional<std::string> keyframe(const std::string&, std::size_t session,
                                      std::size_t keyframe) override {
    return session == 1 && keyframe == 2 ? std::optional<std::string>("points") : std::nullopt;
  }
  ViewAnswer decide(const NamedLoop& loop, LoopStatement statement, std::int64_t epoch) override {
    asked = loop.query + " " + loop.match + " " + std::to_string(static_cast<int>(statement)) +
            " " + std::to_string(epoch);
    return {200, R"({"epoch":8})"};
  }

  std::string asked;
  bool fails = false;
};

struct Serving {
  OneBlock map;
  ViewServer server;
  int port;

  explicit Serving(const std::string& token = "secret")
      : server({"127.0.0.1:0", token, "<p>page</p>"}, map),
        port(std::stoi(server.url().substr(std::string("http://127.0.0.1:").size()))) {}

  [[nodiscard]] httplib::Client client() const {
    httplib::Client client("127.0.0.1", port);
    client.set_read_timeout(20);
    return client;
  }
};

/// A connection that has sent these bytes, which may be no client's.
int connection_with(int port, const std::string& bytes) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  REQUIRE(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  (void)!::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  return socket;
}

/// Connections that have sent these bytes and do nothing more.
std::vector<int> idle_connections(int port, const std::string& bytes) {
  std::vector<int> idle;
  for (int i = 0; i < 30; ++i) idle.push_back(connection_with(port, bytes));
  return idle;
}

/// What the server answers until it closes the connection.
std::string answer_of(int socket) {
  std::string answer;
  char part[65536];
  for (ssize_t got = 0; (got = ::recv(socket, part, sizeof part, 0)) > 0;) {
    answer.append(part, static_cast<std::size_t>(got));
  }
  ::close(socket);
  return answer;
}

}  // namespace

TEST_CASE("a server answers with the page, the map and its points") {
  const Serving serving;
  auto client = serving.client();
  CHECK(client.Get("/")->body == "<p>page</p>");
  CHECK_THAT(client.Get("/")->get_header_value("Content-Security-Policy"),
             Contains("default-src 'none'"));
  CHECK(client.Get("/api/map")->body == R"({"format":1})");
  CHECK(client.Get("/api/map?epoch=12")->status == 200);
  CHECK(serving.map.asked == "12");
  CHECK(client.Get("/api/map?epoch=x")->status == 400);
  client.set_decompress(false);
  const auto points = client.Get("/api/tiles/7.2/static/r");
  CHECK(points->body == "points");
  CHECK(points->get_header_value("Content-Encoding") == "gzip");
  CHECK_THAT(points->get_header_value("Cache-Control"), Contains("immutable"));
  CHECK(serving.map.asked == "7.2 static r");
  CHECK(client.Get("/api/keyframes/7.2/1/2")->status == 200);
}

TEST_CASE("what is not there is an error in words, and no path leads out of the map") {
  Serving serving;
  auto client = serving.client();
  for (const char* path :
       {"/nothing", "/api/tiles/7/static/r9", "/api/tiles/7/../r", "/api/tiles/../../etc/passwd/r",
        "/api/tiles/7/static/r0%2f..%2f..", "/api/tiles/7/st%2e%2e/r", "/api/keyframes/7/1/x",
        "/api/keyframes/7/1/99999999999", "/api/keyframes/7/0/0", "/../../etc/passwd"}) {
    INFO(path);
    const auto response = client.Get(path);
    REQUIRE(response);
    CHECK(response->status == 404);
    CHECK(Json::parse(response->body)["error"].is_string());
  }
  serving.map.fails = true;
  const auto response = client.Get("/api/map");
  CHECK(response->status == 500);
  CHECK(Json::parse(response->body)["error"] == "the store is gone");
}

TEST_CASE("only who knows the token changes the map, by a request that is one") {
  Serving serving;
  auto client = serving.client();
  const std::string good = R"({"statement":"wrong","epoch":7,"query":"b:4","match":"a:0"})";
  const auto post = [&](const std::string& token, const std::string& body,
                        const char* path = "/api/loops/statement") {
    const httplib::Headers headers{{"Authorization", "Bearer " + token}};
    return client.Post(path, headers, body, "application/json");
  };
  CHECK(client.Post("/api/loops/statement", good, "application/json")->status == 401);
  CHECK(post("secreT", good)->status == 401);
  for (const char* bad : {"", "{", "[]", R"({"statement":"wrong"})",
                          R"({"statement":5,"epoch":7,"query":"b:4","match":"a:0"})",
                          R"({"statement":"maybe","epoch":7,"query":"b:4","match":"a:0"})",
                          R"({"statement":"wrong","epoch":"7","query":"b:4","match":"a:0"})",
                          R"({"statement":"wrong","epoch":7,"query":"b:4"})",
                          R"({"statement":"wrong","epoch":7,"query":4,"match":0})"}) {
    INFO(bad);
    CHECK(post("secret", bad)->status == 400);
  }
  CHECK(serving.map.asked.empty());
  const auto response = post("secret", good);
  CHECK(response->status == 200);
  CHECK(response->body == R"({"epoch":8})");
  CHECK(serving.map.asked == "b:4 a:0 1 7");
  CHECK(post("secret", R"({"epoch":7})", "/api/undo")->status == 403);
  const auto refused = post("secret", std::string(1U << 20U, ' '));
  CHECK((!refused || refused->status == 413));
}

TEST_CASE("a server without a token lets nobody change the map") {
  const Serving serving("");
  const httplib::Headers empty{{"Authorization", "Bearer "}};
  CHECK(serving.client()
            .Post("/api/loops/statement", empty, R"({"statement":"wrong","epoch":7})",
                  "application/json")
            ->status == 401);
}

TEST_CASE("malformed requests end their connection alone") {
  const Serving serving;
  for (const std::string& bytes :
       {std::string("\r\n\r\n"), std::string("GET\r\n\r\n"), std::string(1, '\0'),
        std::string("GET / HTTP/9.9\r\n\r\n"),
        "GET /" + std::string(20000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nX: " + std::string(20000, 'a') + "\r\n\r\n",
        std::string("POST /api/undo HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n"),
        std::string("POST /api/undo HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n")}) {
    const int socket = connection_with(serving.port, bytes);
    ::shutdown(socket, SHUT_WR);
    (void)answer_of(socket);
    CHECK(serving.client().Get("/api/map")->status == 200);
  }
}

TEST_CASE("clients that send nothing leave room for others, and are let go", "[slow]") {
  const Serving serving;
  const std::vector<int> idle = idle_connections(serving.port, "GET /api");
  CHECK(serving.client().Get("/api/map")->status == 200);
  char byte = 0;
  CHECK(::recv(idle.front(), &byte, 1, 0) <= 0);  // closed by the server after its timeout
  for (const int socket : idle) ::close(socket);
}

TEST_CASE("clients that read nothing leave room for others, and are let go", "[slow]") {
  const Serving serving;
  const std::vector<int> idle =
      idle_connections(serving.port, "GET /api/tiles/7/static/r7 HTTP/1.1\r\n\r\n");
  CHECK(serving.client().Get("/api/map")->status == 200);
  // Ten seconds without a byte taken; on a busy machine some of the answers begin late.
  std::this_thread::sleep_for(std::chrono::seconds(14));
  const auto let_go = std::count_if(
      idle.begin(), idle.end(), [](int socket) { return answer_of(socket).size() < kLargeBlock; });
  CHECK(let_go >= 20);
  auto client = serving.client();
  client.set_decompress(false);
  CHECK(client.Get("/api/tiles/7/static/r7")->body.size() == kLargeBlock);
}

TEST_CASE("who follows the map hears of events at once, and too many are refused") {
  Serving serving;
  std::string heard;
  std::atomic<bool> follows{false};
  std::thread follower([&] {
    auto client = serving.client();
    client.Get(
        "/api/events",
        [&](const httplib::Response&) {
          follows = true;
          return true;
        },
        [&](const char* data, std::size_t size) {
          heard.append(data, size);
          return heard.find("event: keyframe") == std::string::npos;
        });
  });
  while (!follows) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  serving.map.events().publish("keyframe", R"({"session":0})");
  follower.join();
  CHECK_THAT(heard, Contains(R"(data: {"session":0})"));

  std::vector<std::thread> followers;
  std::atomic<int> refused{0};
  std::atomic<int> accepted{0};
  std::atomic<bool> ending{false};
  for (int i = 0; i < 40; ++i) {
    followers.emplace_back([&] {
      auto client = serving.client();
      (void)client.Get(
          "/api/events",
          [&](const httplib::Response& head) {
            ++(head.status == 200 ? accepted : refused);
            return true;
          },
          [&](const char*, std::size_t) { return !ending; });
    });
  }
  while (accepted + refused < 40) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  // The first follower may not have been let go yet.
  CHECK((refused == 40 - 32 || refused == 40 - 31));
  CHECK(serving.client().Get("/api/map")->status == 200);
  ending = true;
  serving.map.events().publish("map", "{}");
  for (std::thread& thread : followers) thread.join();
}

TEST_CASE("counters are served with a page and without one") {
  OneBlock map;
  const ViewServerOptions options{"127.0.0.1:0", "", "page", [] { return "some 3\n"; }};
  const ViewServer with_page(options, map);
  const ViewServer alone(options);
  for (const ViewServer* server : {&with_page, &alone}) {
    httplib::Client client(server->url().substr(0, server->url().size() - 1));
    CHECK(client.Get("/metrics")->body == "some 3\n");
    CHECK(client.Get("/")->status == (server == &alone ? 404 : 200));
  }
}

TEST_CASE("an address that is none, or is taken, is an error in words") {
  OneBlock map;
  for (const char* wrong : {"", "8080", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:80x", ":80"}) {
    INFO(wrong);
    CHECK_THROWS_WITH(ViewServer({wrong, "", ""}, map), Contains("is no address"));
  }
  const Serving serving;
  const std::string taken = "127.0.0.1:" + std::to_string(serving.port);
  CHECK_THROWS_WITH(ViewServer({taken, "", ""}, map), Contains("cannot listen at " + taken));
}

TEST_CASE("tokens are long and differ") {
  CHECK(make_token().size() == 32);
  CHECK(make_token() != make_token());
}
