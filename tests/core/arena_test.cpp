// Tests of the arena.
#include "unimapper/core/arena.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

struct alignas(64) Block {
  std::array<std::byte, 1024> bytes;
};

}  // namespace

TEST_CASE("a measuring arena counts what a real one uses, to the byte") {
  const auto lay_out = [](Arena& arena) {
    arena.allocate<std::uint8_t>(1);
    arena.allocate<double>(9);
    arena.allocate<std::uint32_t>(0);
    arena.allocate<std::uint16_t>(33);
  };
  Arena measuring = Arena::measuring();
  lay_out(measuring);
  CHECK(measuring.used() == 64 + 128 + 0 + 128);
  CHECK(measuring.is_measuring());
  CHECK_FALSE(measuring.exhausted());
  CHECK(Arena::measuring().allocate<int>(10) == nullptr);

  Block block;
  Arena exact(block.bytes.data(), measuring.used());
  lay_out(exact);
  CHECK(exact.used() == measuring.used());
  CHECK_FALSE(exact.exhausted());

  Arena short_by_one(block.bytes.data(), measuring.used() - 1);
  lay_out(short_by_one);
  CHECK(short_by_one.exhausted());
}

TEST_CASE("arrays are aligned, zeroed and do not overlap") {
  Block block;
  block.bytes.fill(std::byte{0xAB});
  Arena arena(block.bytes.data(), block.bytes.size());
  auto* first = arena.allocate<std::uint8_t>(3);
  auto* second = arena.allocate<double>(2);
  REQUIRE(first != nullptr);
  REQUIRE(second != nullptr);
  CHECK(reinterpret_cast<std::uintptr_t>(first) % Arena::kAlignment == 0);
  CHECK(reinterpret_cast<std::uintptr_t>(second) % Arena::kAlignment == 0);
  CHECK(first[2] == 0);
  CHECK(second[1] == 0.0);
  CHECK(reinterpret_cast<std::byte*>(second) >= reinterpret_cast<std::byte*>(first) + 3);
}

TEST_CASE("an exhausted arena stays exhausted and never writes beyond its block") {
  Block block;
  block.bytes.fill(std::byte{0xAB});
  Arena arena(block.bytes.data(), 128);
  CHECK(arena.allocate<std::byte>(200) == nullptr);
  CHECK(arena.exhausted());
  CHECK(block.bytes[128] == std::byte{0xAB});
  CHECK(block.bytes[0] == std::byte{0xAB});
  CHECK(arena.allocate<std::byte>(1) == nullptr);
}

TEST_CASE("sets of arrays that share memory take the room of the larger one") {
  const auto lay_out = [](Arena& arena) {
    arena.allocate<std::byte>(64);
    std::byte* small = nullptr;
    std::byte* large = nullptr;
    arena.share([&] { small = arena.allocate<std::byte>(128); },
                [&] { large = arena.allocate<std::byte>(256); });
    CHECK(small == large);
    arena.share([&] { large = arena.allocate<std::byte>(256); },
                [&] { small = arena.allocate<std::byte>(64); });
    CHECK(small == large);
    return arena.allocate<std::byte>(1);
  };
  Block block;
  Arena arena(block.bytes.data(), block.bytes.size());
  CHECK(lay_out(arena) == block.bytes.data() + 64 + 256 + 256);
  Arena measuring = Arena::measuring();
  lay_out(measuring);
  CHECK(measuring.used() == arena.used());
}
