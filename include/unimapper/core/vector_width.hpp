// Loops compiled for several vector widths
#pragma once

#include <cstdint>

namespace unimapper {

/// Vector registers that a loop is compiled for. What it computes has the same bits with all of
/// them: lanes do not depend on each other, and products and sums are not contracted.
enum class VectorWidth : std::uint8_t {
  kBaseline,  ///< what every processor of the architecture has: SSE2, NEON, or none
  kAvx2,      ///< eight floats
  kAvx512,    ///< 16 floats
};

/// The widest that this processor has.
[[nodiscard]] inline VectorWidth widest_vectors() noexcept {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0) {
    return VectorWidth::kAvx512;
  }
  if (__builtin_cpu_supports("avx2") != 0) return VectorWidth::kAvx2;
#endif
  return VectorWidth::kBaseline;
}

/// Put on a lambda that `run_vectorised` compiles: a call would not be compiled again.
#define UNIMAPPER_VECTORISED __attribute__((always_inline))

#ifdef __x86_64__
template <typename Loop>
[[gnu::target("avx2"), gnu::noinline]] void run_with_avx2(const Loop& loop) noexcept {
  loop();
}
template <typename Loop>
[[gnu::target("avx512vl,avx512dq"), gnu::noinline]] void run_with_avx512(
    const Loop& loop) noexcept {
  loop();
}
#endif

/// Runs `loop()`, a lambda with `UNIMAPPER_VECTORISED`, with vectors of that width.
template <typename Loop>
inline void run_vectorised(VectorWidth width, const Loop& loop) noexcept {
#ifdef __x86_64__
  if (width == VectorWidth::kAvx512) return run_with_avx512(loop);
  if (width == VectorWidth::kAvx2) return run_with_avx2(loop);
#endif
  static_cast<void>(width);
  loop();
}

}  // namespace unimapper
