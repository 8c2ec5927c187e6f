// Options of the merger for listening
#include "src/apps/merge/listen_options.hpp"

#include <catch2/catch.hpp>

using namespace unimapper;
using namespace unimapper::apps;

TEST_CASE("the merger waits for the first message and in pauses as long as it is told to") {
  MergeOptions options;
  options.listen = "udpm://239.255.76.67:7667?ttl=0";
  options.sessions = 3;
  options.first_timeout_s = 12.5;
  options.idle_timeout_s = 0.25;
  const lcm_port::ListenOptions listening = listen_options(options);
  CHECK(listening.url == options.listen);
  CHECK(listening.sessions_expected == 3);
  CHECK(listening.first_message_timeout == std::chrono::milliseconds(12500));
  CHECK(listening.idle_timeout == std::chrono::milliseconds(250));
}
