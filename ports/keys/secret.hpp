// Secret bytes that leave no copy in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace unimapper::keys {

/// Secret of fixed size, overwritten with zeros when it goes.
template <std::size_t kBytes>
class Secret {
 public:
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { clear(); }

  /// The bytes, e.g. for libsodium.
  [[nodiscard]] std::uint8_t* data() { return bytes_.data(); }
  /// The bytes, e.g. for libsodium.
  [[nodiscard]] const std::uint8_t* data() const { return bytes_.data(); }
  /// How many there are.
  [[nodiscard]] static constexpr std::size_t size() { return kBytes; }
  /// The bytes.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  /// Writes that the compiler may not leave out.
  void clear() {
    volatile std::uint8_t* byte = bytes_.data();
    for (std::size_t i = 0; i < kBytes; ++i) byte[i] = 0;
  }

  std::array<std::uint8_t, kBytes> bytes_{};
};

}  // namespace unimapper::keys
