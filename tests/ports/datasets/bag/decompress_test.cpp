// Tests of decompression with bounded output. The packed bytes were written by lz4 1.9, zstd 1.5
// and bzip2 1.0.
#include "ports/datasets/bag/decompress.hpp"

#include <catch2/catch.hpp>

#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

const std::string kPlain = "points points points points points points";

struct Packed {
  Compression compression;
  std::string bytes;
};
const std::vector<Packed> kPacked = {
    {Compression::kLz4, hex("04224d186440a7110000007f706f696e74732007000a506f696e7473000000"
                            "00fd04550d")},
    {Compression::kZstd, hex("28b52ffd24296d000038706f696e7473200100728a1148476e57")},
    {Compression::kBzip2, hex("425a6839314159265359fe4829b400000b918040000021cc002000310c008a1a1a"
                              "90707472270f0f8bb9229c28487f2414da00")},
};

}  // namespace

TEST_CASE("a block decompresses to the bytes it states") {
  for (const Packed& packed : kPacked) {
    CHECK(decompress(packed.bytes, packed.compression, kPlain.size()) == kPlain);
  }
  CHECK(decompress(kPlain, Compression::kNone, kPlain.size()) == kPlain);
  CHECK(decompress("", Compression::kLz4, 0).empty());
}

TEST_CASE("a block with fewer or more bytes than it states is refused") {
  for (const Packed& packed : kPacked) {
    const auto error_for = [&](std::size_t stated) {
      return error_of([&] { decompress(packed.bytes, packed.compression, stated); });
    };
    CHECK_THAT(error_for(40), Contains("decompresses to more than the 40 bytes it states"));
    CHECK_THAT(error_for(42), Contains("decompresses to fewer than the 42 bytes it states"));
  }
}

TEST_CASE("a block that states more than a recorder writes is refused before any memory is taken") {
  CHECK_THAT(error_of([&] { decompress(kPacked[0].bytes, Compression::kLz4, UINT64_MAX); }),
             Contains("at most 268435456 are read"));
}

TEST_CASE("a torn or damaged block is refused") {
  for (const Packed& packed : kPacked) {
    for (std::size_t bytes = 1; bytes + 5 < packed.bytes.size(); ++bytes) {
      CHECK_THROWS_AS(decompress(packed.bytes.substr(0, bytes), packed.compression, kPlain.size()),
                      DatasetError);
    }
    CHECK_THROWS_AS(decompress(kPlain, packed.compression, kPlain.size()), DatasetError);
  }
}

TEST_CASE("contents that are compressed themselves stay as they are") {
  // A Zstandard frame whose contents are the magic bytes of another.
  const std::string frame = hex("28b52ffd 2004 210000 28b52ffd");
  CHECK(decompress(frame, Compression::kZstd, 4) == hex("28b52ffd"));
}

TEST_CASE("a block of unstated length is read as far as wanted") {
  for (const Packed& packed : kPacked) {
    CHECK(decompress_prefix(packed.bytes, packed.compression) == kPlain);
    CHECK(decompress_prefix(packed.bytes, packed.compression, 6) == "points");
  }
}

TEST_CASE("a compressed file becomes a plain one") {
  const unimapper::TemporaryDirectory directory;
  const auto packed = directory.write("bag.zstd", kPacked[1].bytes);
  decompress_file(packed, Compression::kZstd, directory / "bag");
  CHECK(read_bytes(directory / "bag") == kPlain);
  const auto torn = directory.write("torn.zstd", kPacked[1].bytes.substr(0, 20));
  CHECK_THAT(error_of([&] { decompress_file(torn, Compression::kZstd, directory / "bag"); }),
             Contains("torn.zstd: cannot be decompressed"));
}
