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
  const auto fault = [](const char* url) { return address_fault(url); };
  CHECK_THAT(fault("239.255.76.67:7667"), Contains("begins with udpm://"));
  CHECK_THAT(fault("robot1"), Contains("begins with udpm://"));
  CHECK_THAT(fault(""), Contains("begins with udpm://"));
  CHECK_THAT(fault("udp://239.255.76.67:7667"), Contains("not \"udp\""));
  CHECK_THAT(fault("udpm://127.0.0.1:7667"), Contains("multicast group, 224.0.0.0"));
  CHECK_THAT(fault("udpm://240.0.0.1:7667"), Contains("multicast group, 224.0.0.0"));
  CHECK_THAT(fault("udpm://localhost:7667"), Contains("IPv4 address"));
  CHECK_THAT(fault("udpm://239.255.76:7667"), Contains("IPv4 address"));
  CHECK_THAT(fault("udpm://239.255.76.300:7667"), Contains("IPv4 address"));
  CHECK_THAT(fault("udpm://239.255.76.67:"), Contains("1 to 65535"));
  CHECK_THAT(fault("udpm://239.255.76.67:70000"), Contains("1 to 65535"));
  CHECK_THAT(fault("udpm://239.255.76.67:7667ttl=0"), Contains("1 to 65535"));
  CHECK_THAT(fault("udpm://127.0.0.1"), Contains("such as udpm://239.255.76.67:7667?ttl=0"));
}
