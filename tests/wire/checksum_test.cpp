// Tests of the checksum.
#include "unimapper/wire/checksum.hpp"

#include <catch2/catch.hpp>
#include <vector>

using namespace unimapper::wire;

TEST_CASE("the checksum is the one of zlib and Ethernet") {
  const std::vector<std::uint8_t> text{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(crc32(text) == 0xCBF43926);
  CHECK(crc32({}) == 0);
}
