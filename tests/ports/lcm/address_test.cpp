// Form of LCM addresses
#include "ports/lcm/address.hpp"

#include <catch2/catch.hpp>

using Catch::Matchers::Contains;
using unimapper::lcm_port::address_fault;

TEST_CASE("Addresses that LCM takes have no fault", "[address]") {
  for (const char* url :
       {"udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.67:7667", "udpm://224.0.0.1",
        "udpm://", "udpm://?ttl=1", "tcpq://localhost:7700", "file:///tmp/log", "memq://"}) {
    INFO(url);
    CHECK(address_fault(url).empty());
  }
}

TEST_CASE("The fault of an address is named, with one that would do", "[address]") {
  const char* faults[][2] = {
      {"239.255.76.67:7667", "begins with udpm://"},
      {"", "begins with udpm://"},
      {"udp://239.255.76.67:7667", "not \"udp\""},
      {"udpm://127.0.0.1:7667", "multicast group, 224.0.0.0"},
      {"udpm://240.0.0.1:7667", "multicast group, 224.0.0.0"},
      {"udpm://localhost:7667", "IPv4 address"},
      {"udpm://239.255.76:7667", "IPv4 address"},
      {"udpm://239.255.76.300:7667", "IPv4 address"},
      {"udpm://239.255.76.67:", "1 to 65535"},
      {"udpm://239.255.76.67:70000", "1 to 65535"},
      {"udpm://239.255.76.67:7667ttl=0", "1 to 65535"},
      {"udpm://127.0.0.1", "such as udpm://239.255.76.67:7667?ttl=0"},
  };
  for (const auto& [url, words] : faults) CHECK_THAT(address_fault(url), Contains(words));
}
