// Tests of the pieces of keyframes and of their checksum.
#include "unimapper/wire/pieces.hpp"

#include "tests/test.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/messages.hpp"

using namespace unimapper::wire;

TEST_CASE("the checksum is the one of zlib and Ethernet") {
  const std::vector<std::uint8_t> text{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  CHECK(crc32(text) == 0xCBF43926);
  CHECK(crc32({}) == 0);
}

TEST_CASE("a keyframe is cut into as few possible pieces as can hold it, all but the last full") {
  for (std::uint32_t piece_bytes = 1; piece_bytes <= 12; ++piece_bytes) {
    for (std::size_t bytes = 1; bytes <= 40; ++bytes) {
      CAPTURE(piece_bytes, bytes);
      EncodedKeyframe keyframe;
      keyframe.bytes.assign(bytes, 7);
      const std::vector<ChunkMessage> pieces = cut_into_pieces(keyframe, piece_bytes);
      REQUIRE(pieces.size() == (bytes + piece_bytes - 1) / piece_bytes);
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        CHECK(is_possible(pieces[i]));
        CHECK(pieces[i].index == i);
        CHECK(pieces[i].count == pieces.size());
        CHECK(pieces[i].total_bytes == bytes);
        const bool is_last = i + 1 == pieces.size();
        CHECK(pieces[i].data.size() == (is_last ? bytes - i * piece_bytes : piece_bytes));
      }
    }
  }
}
