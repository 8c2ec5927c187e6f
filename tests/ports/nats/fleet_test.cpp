// Tests of sites whose stores reach a centre through a real server.
#include <mutex>
#include <thread>

#include "ports/nats/downlink.hpp"
#include "ports/nats/fleet_status.hpp"
#include "ports/nats/subjects.hpp"
#include "ports/nats/uplink.hpp"
#include "tests/ports/nats/server.hpp"
#include "tests/ports/store/base.hpp"

using namespace unimapper;
using namespace unimapper::nats_port;
using namespace unimapper::nats_port::nats_test;
using namespace unimapper::store::store_test;
using Catch::Matchers::Contains;

namespace {

const SessionInfo kAlpha{{1, {7, 11}}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

/// What was said, from any thread.
class Sayings {
 public:
  std::function<void(const std::string&)> take() {
    return [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      said_ += text + "\n";
    };
  }
  [[nodiscard]] std::string all() const {
    const std::lock_guard lock(mutex_);
    return said_;
  }
  [[nodiscard]] std::size_t count(const std::string& words) const {
    std::size_t found = 0;
    const std::string said = all();
    for (std::size_t at = said.find(words); at != std::string::npos;
         at = said.find(words, at + 1)) {
      ++found;
    }
    return found;
  }

 private:
  mutable std::mutex mutex_;
  std::string said_;
};

struct Site {
  TemporaryDirectory folder;
  Base base{folder.path()};
  Sayings sayings;

  void drive(const SessionInfo& info, std::uint32_t keyframes) {
    base.feed(wire_test::session_stream(info, keyframes));
    base.advance();
  }
  std::unique_ptr<Uplink> uplink(const TestServer& server, bool sends_all = false) {
    return start_uplink({server.address(), folder.path(), "north", sends_all, sayings.take()},
                        base.store.lock());
  }
};

class Centre {
 public:
  explicit Centre(const TestServer& server, const wire::ReceiverLimits& limits = {},
                  const store::StoreOptions& options = impatient())
      : store_(folder_.path(), options),
        downlink_(start_downlink(
            {server.address(), 1U << 20U, std::chrono::milliseconds(300), sayings.take()}, store_)),
        receiver_(limits, *downlink_) {}

  /// As a base does it, until so much of it is true or 20 seconds have passed.
  template <typename Condition>
  void run_until(const Condition& is_enough) {
    for (int i = 0; i < 4000 && !is_enough(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      downlink_->take(receiver_);
      receiver_.advance(now_ns_ += kSecondNs);
    }
    REQUIRE(is_enough());
  }
  void run_until_stored(std::uint64_t keyframes) {
    run_until([&] { return store_.counters().keyframes >= keyframes; });
  }
  [[nodiscard]] DownlinkCounters counters() const { return downlink_->counters(); }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path(); }

  Sayings sayings;

 private:
  TemporaryDirectory folder_;
  store::KeyframeStore store_;
  std::unique_ptr<Downlink> downlink_;
  wire::Receiver receiver_;
  std::int64_t now_ns_ = 0;
};

/// Both hold the same keyframes; the centre each once.
void check_same(const Site& site, const Centre& centre) {
  CHECK(stored_bytes(centre.folder()) == stored_bytes(site.folder.path()));
  CHECK(store::StoreReader(centre.folder()).check().empty());
}

std::uint64_t waiting_in(const TestServer& server) {
  jsStreamInfo* info = nullptr;
  const auto connection = server.connection();
  require(js_GetStreamInfo(&info, connection->jetstream(), kKeyframeStream, nullptr, nullptr), "");
  const std::uint64_t messages = info->State.Msgs;
  jsStreamInfo_Destroy(info);
  return messages;
}

template <typename Condition>
void wait_until(const Condition& is_enough) {
  for (int i = 0; i < 4000 && !is_enough(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  REQUIRE(is_enough());
}

std::vector<std::int64_t> order_of(const std::filesystem::path& folder) {
  store::Database database = store::open_for_reading(folder);
  store::Statement rows(database,
                        "SELECT robot, sequence FROM keyframes JOIN sessions ON session = id "
                        "ORDER BY keyframes.rowid");
  std::vector<std::int64_t> order;
  while (rows.step()) order.push_back(rows.number(0) * 1000 + rows.number(1));
  return order;
}

}  // namespace

TEST_CASE("what a site has stored reaches the centre, each keyframe once and in order") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  Site site;
  site.drive(kAlpha, 3);  // before there is an uplink
  auto uplink = site.uplink(server);
  site.drive(kBeta, 70);
  site.base.feed(kAlpha.id, 3);
  site.base.advance();
  Centre centre(server);
  const auto names = [&centre] {
    std::vector<std::string> all;
    for (const auto& session : store::StoreReader(centre.folder()).sessions()) {
      if (session.ended) all.push_back(session.info.name + " " + session.info.sensor);
    }
    return all;
  };
  centre.run_until_stored(74);
  centre.run_until([&] { return names().size() == 2 && waiting_in(server) == 0; });
  CHECK(names() == std::vector<std::string>{"alpha os2-128", "beta vlp-16"});
  check_same(site, centre);
  CHECK(order_of(centre.folder()) == order_of(site.folder.path()));
  CHECK(uplink->finish().keyframes == 74);
  CHECK(centre.counters().dropped == 0);
  // All of it is marked; sent again on demand, it is nothing new.
  CHECK(site.uplink(server)->finish().keyframes == 0);
  CHECK(site.uplink(server, true)->finish().keyframes == 74);
  check_same(site, centre);
}

TEST_CASE("a server that is killed between site and centre loses nothing") {
  if (!TestServer::is_installed()) return;
  TestServer server;
  Site site;
  site.drive(kAlpha, 8);
  const auto uplink = site.uplink(server);
  Centre centre(server);
  centre.run_until_stored(1);
  server.kill();
  site.drive(kBeta, 8);
  wait_until([&] { return site.sayings.count("the uplink waits") >= 1; });
  server.start();
  centre.run_until_stored(16);
  check_same(site, centre);
  CHECK(uplink->counters().failures > 0);
  CHECK(site.sayings.count("the uplink waits") <= 2);
}

TEST_CASE("a site and a centre that end anywhere go on where they were") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  Site site;
  site.drive(kAlpha, 20);
  site.uplink(server).reset();  // whatever it was at
  site.drive(kBeta, 3);
  CHECK(site.uplink(server)->finish().failures == 0);
  {
    store::StoreOptions never;
    never.batch_interval_ns = std::numeric_limits<std::int64_t>::max();
    Centre ended(server, {}, never);
    ended.run_until([&] { return ended.counters().messages >= 20; });
    CHECK(stored_bytes(ended.folder()).empty());  // nothing was committed
  }
  Centre centre(server);
  centre.run_until_stored(23);
  check_same(site, centre);
}

TEST_CASE("a leaf node without streams hands on what a site sends") {
  if (!TestServer::is_installed()) return;
  const std::string port = std::to_string(TestServer::free_port());
  const TestServer server("leafnodes { listen: \"127.0.0.1:" + port + "\" }");
  const TestServer leaf(
      "leafnodes { remotes: [ { url: \"nats-leaf://127.0.0.1:" + port + "\" } ] }", false);
  Site site;
  site.drive(kAlpha, 2);
  Centre centre(server);
  const auto uplink = site.uplink(leaf);
  centre.run_until_stored(2);
  check_same(site, centre);
}

TEST_CASE("a full stream is told once, and what does not fit stays at the site until it does") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  jsStreamInfo* info = nullptr;
  const auto connection = server.connection();
  require(js_GetStreamInfo(&info, connection->jetstream(), kKeyframeStream, nullptr, nullptr), "");
  info->Config->MaxBytes = 20'000;
  require(js_UpdateStream(nullptr, connection->jetstream(), info->Config, nullptr, nullptr), "");
  jsStreamInfo_Destroy(info);
  Site site;
  site.drive(kAlpha, 12);
  const auto uplink = site.uplink(server);
  wait_until([&] { return uplink->counters().failures >= 2; });
  CHECK_THAT(site.sayings.all(), Contains("the stream refuses messages"));
  CHECK(site.sayings.count("refuses messages") == 1);
  CHECK(uplink->counters().keyframes < 12);
  site.drive(kBeta, 1);  // the robots' delivery goes on
  Centre centre(server);
  centre.run_until_stored(13);
  check_same(site, centre);
}

TEST_CASE("forged messages are dropped for good and do not stop what follows") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto connection = server.connection();
  const auto forge = [&](const Subject& subject, const std::vector<std::uint8_t>& bytes) {
    require(js_Publish(nullptr, connection->jetstream(), to_text(subject).c_str(), bytes.data(),
                       static_cast<int>(bytes.size()), nullptr, nullptr),
            "");
  };
  std::vector<std::uint8_t> keyframe = wire::encode_keyframe(wire_test::keyframe_of(kAlpha.id, 0));
  forge({"south", kAlpha.id, 1}, keyframe);             // of another number
  forge({"south", kBeta.id, 0}, keyframe);              // of another session
  forge({"south", kAlpha.id, 0}, {});                   // nothing
  forge({"south", kAlpha.id, std::nullopt}, keyframe);  // no session
  keyframe.resize(keyframe.size() / 2);
  forge({"south", kAlpha.id, 0}, keyframe);
  forge({"south", kAlpha.id, 0}, std::vector<std::uint8_t>((1U << 20U) - 600, 1));
  require(js_Publish(nullptr, connection->jetstream(), "unimapper.a.b.c.keyframe.d", "x", 1,
                     nullptr, nullptr),
          "");
  Site site;
  site.drive(kAlpha, 2);
  const auto uplink = site.uplink(server);
  Centre centre(server);
  centre.run_until_stored(2);
  centre.run_until([&] { return waiting_in(server) == 0; });
  CHECK(centre.counters().dropped == 7);
  CHECK(centre.sayings.count("was dropped") == 1);
  check_same(site, centre);
}

TEST_CASE("a centre that has lost its store gets all of it again at once") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  Site site;
  site.drive(kAlpha, 3);
  site.uplink(server)->finish();
  {
    Centre lost(server);
    lost.run_until_stored(3);
    lost.run_until([&] { return waiting_in(server) == 0; });
  }
  CHECK(site.uplink(server, true)->finish().keyframes == 3);
  Centre centre(server);
  centre.run_until_stored(3);
  check_same(site, centre);
}

TEST_CASE("the permissions of the guide are enough, and no way to others' keyframes") {
  if (!TestServer::is_installed()) return;
  const TestServer server(
      "authorization { users: [ { user: centre, password: c }\n"
      "{ user: north, password: n, permissions: {\n"
      "  publish: [\"unimapper.north.>\", \"$JS.API.STREAM.INFO.*\"],\n"
      "  subscribe: [\"_INBOX.north.>\"] } } ] }\n"
      "no_auth_user: centre");
  // The names of its messages, used up.
  const auto north = std::make_unique<Connection>(server.address("north:n@"));
  jsPubOptions options;
  require(jsPubOptions_Init(&options), "");
  const std::string subject = to_text({"north", kAlpha.id, 0});
  const std::string id = subject.substr(std::string_view("unimapper.north.").size());
  options.MsgId = id.c_str();
  require(js_Publish(nullptr, north->jetstream(), subject.c_str(), "x", 1, &options, nullptr), "");
  Site site;
  site.drive(kAlpha, 3);
  const auto uplink = start_uplink(
      {server.address("north:n@"), site.folder.path(), "north", false, site.sayings.take()},
      site.base.store.lock());
  wait_until([&] { return uplink->counters().keyframes == 3; });
  // An answer that goes to where one asks for a purge.
  const std::string purge = std::string("$JS.API.STREAM.PURGE.") + kKeyframeStream;
  require(natsConnection_PublishRequestString(north->handle(), subject.c_str(), purge.c_str(), "x"),
          "");
  require(natsConnection_Flush(north->handle()), "");
  wait_until([&] { return waiting_in(server) >= 6; });
  Centre centre(server);
  centre.run_until_stored(3);
  check_same(site, centre);
}

TEST_CASE("a stream that a power failure has set back is read from its beginning") {
  if (!TestServer::is_installed()) return;
  TestServer server;
  Site site;
  site.drive(kAlpha, 1);
  site.uplink(server)->finish();
  const std::filesystem::path stream = server.files() / "$G" / "streams" / kKeyframeStream;
  server.kill();
  std::filesystem::copy(stream / "msgs", stream / "before");
  server.start();
  site.drive(kBeta, 8);
  const auto uplink = site.uplink(server);
  Centre centre(server);
  centre.run_until_stored(9);
  centre.run_until([&] { return waiting_in(server) == 0; });
  server.kill(SIGTERM);
  std::filesystem::remove_all(stream / "msgs");
  std::filesystem::rename(stream / "before", stream / "msgs");
  server.start();
  site.drive({{3, 33}, "gamma", "vlp-16"}, 3);
  centre.run_until_stored(12);
  check_same(site, centre);
  CHECK(centre.sayings.count("has lost messages") == 1);
}

TEST_CASE("a keyframe larger than the stream's messages keeps no other one back") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto connection = server.connection();
  jsStreamInfo* info = nullptr;
  require(js_GetStreamInfo(&info, connection->jetstream(), kKeyframeStream, nullptr, nullptr), "");
  info->Config->MaxMsgSize = 4096;
  require(js_UpdateStream(nullptr, connection->jetstream(), info->Config, nullptr, nullptr), "");
  jsStreamInfo_Destroy(info);
  Site site;
  site.base.feed(wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0, 3000)));
  site.base.feed(wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1, 30)));
  site.base.advance();
  const UplinkCounters sent = site.uplink(server)->finish();
  CHECK(sent.keyframes == 1);
  CHECK(sent.too_large == 1);
  CHECK(sent.failures == 0);
  CHECK(site.sayings.count("the stream takes no message as large") == 1);
}

TEST_CASE("what a quota of the centre refuses comes again later") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  Site site;
  site.drive(kAlpha, 3);
  const auto uplink = site.uplink(server);
  wire::ReceiverLimits limits;
  limits.robot.bytes = 1;
  {
    Centre strict(server, limits);
    strict.run_until([&] { return strict.counters().postponed >= 3; });
    CHECK(strict.counters().stored == 0);
  }
  Centre centre(server);
  centre.run_until_stored(3);
  check_same(site, centre);
}

TEST_CASE("a keyframe larger than the server's messages is told once and goes when it may") {
  if (!TestServer::is_installed()) return;
  TestServer server("max_payload: 4096");
  Site site;
  site.base.feed(wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 0, 3000)));
  site.base.feed(wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 1, 30)));
  site.base.feed(wire_test::pieces(wire_test::keyframe_of(kAlpha.id, 2, 3000)));
  site.base.advance();
  const auto uplink = site.uplink(server);
  Centre centre(server);
  centre.run_until_stored(1);
  CHECK(uplink->counters().too_large == 2);
  CHECK(site.sayings.count("max_payload") == 1);
  server.kill();
  server.start();
  centre.run_until_stored(3);
  check_same(site, centre);
}

TEST_CASE("the server knows how far each site and the centre are") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  Site site;
  site.drive(kAlpha, 3);
  CHECK(site.uplink(server)->finish().keyframes == 3);
  const FleetStatus before = fleet_status(server.address());
  CHECK(before.messages == 4);
  CHECK_FALSE(before.has_centre);
  CHECK(before.pending == 4);
  REQUIRE(before.sites.count("north") == 1);
  CHECK(before.sites.at("north").keyframes == 3);
  CHECK(before.sites.at("north").sessions == 1);
  CHECK(before.sites.at("north").waiting == 0);
  Centre centre(server);
  centre.run_until([&] { return centre.counters().stored == 4; });
  wait_until([&] { return fleet_status(server.address()).messages == 0; });
  const FleetStatus after = fleet_status(server.address());
  CHECK(after.has_centre);
  CHECK(after.pending + after.unanswered == 0);
  CHECK(after.sites.at("north").keyframes == 0);
  CHECK(after.sites.at("north").heard_ns);
}

TEST_CASE("without credentials only servers of this machine are taken") {
  const auto fault_of = [](const std::string& url, const std::string& credentials = {}) {
    Server server;
    server.url = url;
    server.credentials = credentials;
    try {
      check(server);
    } catch (const NatsError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const TemporaryDirectory folder;
  const std::string seed = folder.write("seed", "SUAB\nUAB\n").string();
  for (const char* url : {"nats://127.0.0.1:4222", "nats://localhost", "tls://[::1]:1",
                          "tls://me:word@far.example", "nats://me:word@127.0.0.2"}) {
    INFO(url);
    CHECK(fault_of(url).empty());
  }
  CHECK(fault_of("nats://far.example", seed).empty());
  for (const char* url : {"nats://10.0.0.1:4222", "nats://127.evil.example", "tls://far.example",
                          "nats://localhost@far.example:1", "nats://127.0.0.1,nats://10.0.0.1"}) {
    INFO(url);
    CHECK_FALSE(fault_of(url).empty());
  }
  CHECK_THAT(fault_of("nats://far.example"), Contains("without credentials"));
  CHECK_THAT(fault_of("nats://me:word@far.example"), Contains("in the clear"));
  const std::string password = folder.write("password", "me:word\n").string();
  CHECK_THAT(fault_of("nats://far.example", password), Contains("in the clear"));
  CHECK(fault_of("tls://far.example", password).empty());
  CHECK_THAT(fault_of("http://127.0.0.1"), Contains("nats://HOST:PORT"));
  CHECK_THAT(fault_of("nats://far.example", "/nowhere"), Contains("cannot be read"));
  CHECK(shown({"tls://me:word@far.example:1,nats://near", {}, {}, {}, {}}) ==
        "tls://far.example:1,nats://near");
}

TEST_CASE("a subject has one text, and no other text is one") {
  const Subject subject{"north-1", {4294967295U, {1, 0xABCDEF}}, 17};
  const std::string text =
      "unimapper.north-1.4294967295.00000000000000010000000000abcdef.keyframe.17";
  CHECK(to_text(subject) == text);
  const auto parsed = parse_subject(text);
  REQUIRE(parsed);
  CHECK(parsed->session == subject.session);
  CHECK(parsed->sequence == 17U);
  for (const char* other : {"", "unimapper.a.1.00000000000000010000000000abcdef.keyframe",
                            "unimapper.a.1.00000000000000010000000000ABCDEF.session",
                            "unimapper.a.01.00000000000000010000000000abcdef.session",
                            "unimapper.a b.1.00000000000000010000000000abcdef.session",
                            "unimapper.a.1.00000000000000010000000000abcdef.keyframe.4294967296",
                            "unimapper.a.1.00000000000000010000000000abcdef.session.1"}) {
    INFO(other);
    CHECK_FALSE(parse_subject(other));
  }
}
