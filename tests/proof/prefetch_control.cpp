// Controls of the prefetch test: a prefetch in a function that is not inlined, and none at all.
#include "src/core/prefetch.hpp"

struct Kept {
  const int* values;
  // GCC 12 would delete its calls for a bare __builtin_prefetch.
  [[gnu::noinline]] void prefetch(int i) const noexcept {
    unimapper::prefetch_for_read(values + i);
    unimapper::prefetch_for_write(values + i + 64);
  }
  int sum(int count) const noexcept;
};

int Kept::sum(int count) const noexcept {
  int sum = 0;
  for (int i = 0; i < count; ++i) {
    prefetch(i + 16);
    sum += values[i];
  }
  return sum;
}

struct Missing {
  const int* values;
  int sum() const noexcept;
};

int Missing::sum() const noexcept { return values[0] + values[1]; }
