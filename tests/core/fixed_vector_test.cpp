// Tests of the fixed-capacity vector.
#include "src/core/fixed_vector.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

struct Storage {
  alignas(64) std::array<std::byte, 4096> bytes{};
  Arena arena{bytes.data(), bytes.size()};
};

}  // namespace

TEST_CASE("a vector without memory holds nothing and refuses everything") {
  FixedVector<int> vector;
  CHECK(vector.empty());
  CHECK(vector.full());
  CHECK_FALSE(vector.push_back(1));
  CHECK(vector.refused() == 1);
  vector.pop_back();
  CHECK(vector.size() == 0);

  Arena measuring = Arena::measuring();
  vector.allocate(measuring, 10);
  CHECK(vector.capacity() == 0);
  CHECK_FALSE(vector.push_back(1));
}

TEST_CASE("elements keep their order, and the boundary refuses and counts") {
  Storage storage;
  FixedVector<int> vector;
  vector.allocate(storage.arena, 3);
  for (int i = 0; i < 5; ++i) CHECK(vector.push_back(i) == (i < 3));
  CHECK(vector.full());
  CHECK(vector.available() == 0);
  CHECK(vector.refused() == 2);
  int expected = 0;
  for (const int value : vector) CHECK(value == expected++);
  CHECK(expected == 3);
  CHECK(vector.back() == 2);
  vector.pop_back();
  CHECK(vector.back() == 1);

  vector.clear();
  CHECK(vector.empty());
  CHECK(vector.refused() == 2);
  vector.reset_refused();
  CHECK(vector.refused() == 0);
  CHECK(vector.push_back(9));
  CHECK(vector[0] == 9);
}

TEST_CASE("resizing beyond the capacity changes nothing") {
  Storage storage;
  FixedVector<int> vector;
  vector.allocate(storage.arena, 4);
  CHECK(vector.resize_uninitialized(4));
  CHECK(vector.size() == 4);
  CHECK_FALSE(vector.resize_uninitialized(5));
  CHECK(vector.size() == 4);
  CHECK(vector.view().size() == 4);
}
