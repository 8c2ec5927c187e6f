// Form of LCM addresses
#include "ports/lcm/address.hpp"

#include "tests/test.hpp"

using Catch::Matchers::Contains;
using unimapper::lcm_port::address_fault;

TEST_CASE("Addresses that LCM takes have no fault", "[address]") {
  for (const char* url :
       {"udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.67:7667", "udpm://224.0.0.1:1",
        "udpm://", "udpm://?ttl=1", "udpm://239.255.76.67:7667?ttl=255&recv_buf_size=4194304",
        "udpm://239.255.76.67:7667?ttl=1,transmit_only=true",
        "file:///tmp/a log?speed=0&start_timestamp=5&mode=r", "file:///tmp/log", "memq://"}) {
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
      {"udpm://239.255.76.67", "the port is missing: an address has the form udpm://GROUP:PORT"},
      {"udpm://239.255.76.67?ttl=0", "the port is missing"},
      {"udpm://239.255.76.067:7667", "without leading zeros"},
      {"udpm://239.255.76.67:07667", "without leading zeros"},
      {"udpm://239.255.76.67:7667?ttl=abc", "ttl is a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=256", "ttl is a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=010", "ttl is a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=-1", "ttl is a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl", "ttl is a number from 0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4M", "recv_buf_size is a number of bytes"},
      {"udpm://239.255.76.67:7667?tll=0", "no option \"tll\", but ttl, recv_buf_size, "},
      {"udpm://239.255.76.67:7667?ttl=0,tll=0", "no option \"tll\""},
      {"udpm://239.255.76.67:7667?=0", "no option \"\""},
      {"tcpq://127.0.0.1:7700", "LCM ends a program that uses tcpq when its server is not there"},
      {"memq://?ttl=0", "memq has no option \"ttl\", but none"},
      {"file:///tmp/log?ttl=0", "file has no option \"ttl\""},
      {"udpm://239.255.76.67:7667?ttl=0 ", "no blanks"},
      {"udpm://239.255.76.67:7667 ", "no blanks"},
      {"udpm://127.0.0.1", "such as udpm://239.255.76.67:7667?ttl=0"},
  };
  for (const auto& [url, words] : faults) CHECK_THAT(address_fault(url), Contains(words));
}
