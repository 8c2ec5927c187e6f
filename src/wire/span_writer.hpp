// Little-endian writer into a span that counts what does not fit.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace unimapper::wire {

/// Writes numbers one behind the other. Beyond the end of the span nothing is written, but the
/// position goes on, so that the bytes needed are known afterwards.
class SpanWriter {
 public:
  explicit SpanWriter(std::span<std::uint8_t> out) noexcept : out_(out) {}

  template <std::integral T>
  void put(T value) noexcept {
    put_at(position_, value);
    position_ += sizeof(T);
  }
  void put(double value) noexcept { put(std::bit_cast<std::uint64_t>(value)); }
  void put(float value) noexcept { put(std::bit_cast<std::uint32_t>(value)); }

  /// Overwrites what was written at `position`.
  template <std::integral T>
  void put_at(std::size_t position, T value) noexcept {
    if (position + sizeof(T) > out_.size()) return;
    const auto bits = static_cast<std::make_unsigned_t<T>>(value);
    std::uint8_t* const at = out_.data() + position;
    for (std::size_t i = 0; i < sizeof(T); ++i) at[i] = static_cast<std::uint8_t>(bits >> (8U * i));
  }

  void put(std::span<const std::uint8_t> bytes) noexcept {
    const std::span<std::uint8_t> room = rest();
    if (bytes.size() <= room.size()) {
      for (std::size_t i = 0; i < bytes.size(); ++i) room[i] = bytes[i];
    }
    position_ += bytes.size();
  }

  /// The unwritten rest of the span; after writing to it, pass over the bytes.
  [[nodiscard]] std::span<std::uint8_t> rest() const noexcept {
    return position_ < out_.size() ? out_.subspan(position_) : std::span<std::uint8_t>{};
  }
  void pass(std::size_t bytes) noexcept { position_ += bytes; }

  [[nodiscard]] std::size_t position() const noexcept { return position_; }
  [[nodiscard]] bool fits() const noexcept { return position_ <= out_.size(); }

 private:
  std::span<std::uint8_t> out_;
  std::size_t position_ = 0;
};

}  // namespace unimapper::wire
