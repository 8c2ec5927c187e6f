// Adaptive binary range coder in integer arithmetic
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "span_writer.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

/// Estimated probability that a bit is 0. It starts at a half and follows the bits, by an n-th of
/// the error after n bits at first. It stays within [1/128, 127/128], so that every bit costs at
/// least 0.011 bits: how much a message can expand to is bounded.
class BitModel {
 public:
  /// In units of 1/4096, at least 32 and at most 4064.
  [[nodiscard]] std::uint32_t zero() const noexcept { return zero_ >> 4U; }

  /// Without a branch, which the processor would often guess wrong.
  void update(bool bit) noexcept {
    const std::uint32_t rate = kRates[seen_].rate;
    seen_ = kRates[seen_].next;
    const std::uint32_t mask = 0U - std::uint32_t{bit};
    const std::uint32_t zero = zero_;
    const std::uint32_t error = ((zero - kLowest) & mask) | ((kHighest - zero) & ~mask);
    const std::uint32_t step = (error * rate) >> 16U;
    zero_ = static_cast<std::uint16_t>(zero + ((step ^ mask) - mask));
  }

 private:
  static constexpr std::uint32_t kLowest = 512;
  static constexpr std::uint32_t kHighest = 65536 - 512;
  struct Rate {
    std::uint16_t rate;
    std::uint16_t next;  ///< `seen_` after it
  };
  static constexpr auto kRates = [] {
    std::array<Rate, 48> rates{};
    for (std::uint32_t n = 0; n < rates.size(); ++n) {
      rates[n] = {static_cast<std::uint16_t>(65536U / (n + 2)),
                  static_cast<std::uint16_t>(std::min<std::size_t>(n + 1, rates.size() - 1))};
    }
    return rates;
  }();

  std::uint16_t zero_ = 32768;
  std::uint16_t seen_ = 0;
};

inline constexpr std::uint32_t kSmallestRange = std::uint32_t{1} << 24U;
inline constexpr int kRangeCodeBytes = 4;  ///< of the code's value that are compared at a time

/// Writes bits as a number in an interval that every bit narrows. Carries reach bytes that are not
/// written yet only: the last one, and the 0xFF behind it.
class RangeEncoder {
 public:
  explicit RangeEncoder(SpanWriter& out) noexcept : out_(out) {}

  /// Codes `bit` as `model` expects it, and returns it.
  bool code(bool bit, BitModel& model) noexcept {
    const std::uint32_t bound = (range_ >> 12U) * model.zero();
    if (bit) {
      low_ += bound;
      range_ -= bound;
      model.update(true);
    } else {
      range_ = bound;
      model.update(false);
    }
    while (range_ < kSmallestRange) shift();
    return bit;
  }
  /// What `code` does; the decoder has two ways.
  bool code_doubtful(bool bit, BitModel& model) noexcept { return code(bit, model); }
  /// Codes a bit of which nothing is known.
  bool code(bool bit) noexcept {
    range_ >>= 1U;
    if (bit) low_ += range_;
    while (range_ < kSmallestRange) shift();
    return bit;
  }
  /// Writes the rest, once, after the last bit: the lowest number of the interval.
  void finish() noexcept {
    for (int i = 0; i <= kRangeCodeBytes; ++i) shift();
  }

 private:
  void shift() noexcept {
    const auto carry = static_cast<std::uint8_t>(low_ >> 32U);
    const auto top = static_cast<std::uint8_t>(low_ >> 24U);
    if (carry != 0 || top != 0xFF) {
      if (has_last_) out_.put(static_cast<std::uint8_t>(last_ + carry));
      for (; waiting_ > 0; --waiting_) out_.put(static_cast<std::uint8_t>(0xFF + carry));
      last_ = top;
      has_last_ = true;
    } else {
      ++waiting_;
    }
    low_ = (low_ & 0x00FFFFFFU) << 8U;
    range_ <<= 8U;
  }

  SpanWriter& out_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xFFFFFFFF;
  std::uint8_t last_ = 0;
  bool has_last_ = false;
  std::size_t waiting_ = 0;
};

/// Reads what `RangeEncoder` wrote. Behind the end of the code it reads zeros.
class RangeDecoder {
 public:
  explicit RangeDecoder(Bytes bytes) noexcept : bytes_(bytes) {
    for (int i = 0; i < kRangeCodeBytes; ++i) value_ = value_ << 8U | next();
    // The encoder's number lies below the interval's end.
    valid_ = value_ != 0xFFFFFFFF;
  }

  /// The next bit; the encoder's argument has no meaning here. No bit takes more than a byte, as
  /// each leaves at least a 128th of the range.
  bool code(bool /*bit*/, BitModel& model) noexcept {
    const std::uint32_t bound = (range_ >> 12U) * model.zero();
    const bool bit = value_ >= bound;
    if (bit) {
      value_ -= bound;
      range_ -= bound;
      model.update(true);
    } else {
      range_ = bound;
      model.update(false);
    }
    if (range_ < kSmallestRange) shift();
    return bit;
  }
  /// Like `code`, without a branch: faster where the processor often guesses the bit wrong.
  bool code_doubtful(bool /*bit*/, BitModel& model) noexcept {
    const std::uint32_t bound = (range_ >> 12U) * model.zero();
    const bool bit = value_ >= bound;
    const std::uint32_t mask = 0U - std::uint32_t{bit};
    value_ -= bound & mask;
    range_ = bound + ((range_ - 2 * bound) & mask);
    model.update(bit);
    if (range_ < kSmallestRange) shift();
    return bit;
  }
  /// The next bit of which nothing is known.
  bool code(bool /*bit*/) noexcept {
    range_ >>= 1U;
    const bool bit = value_ >= range_;
    value_ -= range_ & (0U - std::uint32_t{bit});
    if (range_ < kSmallestRange) shift();
    return bit;
  }

  /// More bits were asked for than the bytes hold: what was read is worth nothing.
  [[nodiscard]] bool exhausted() const noexcept { return !valid_ || position_ > bytes_.size(); }
  /// After the last bit: whether these are the bytes `RangeEncoder` writes for the bits read.
  [[nodiscard]] bool ends_here() const noexcept {
    return valid_ && position_ == bytes_.size() && value_ == 0;
  }

 private:
  std::uint8_t next() noexcept {
    const std::size_t at = position_++;
    return at < bytes_.size() ? bytes_[at] : std::uint8_t{0};
  }
  void shift() noexcept {
    value_ = value_ << 8U | next();
    range_ <<= 8U;
  }

  Bytes bytes_;
  std::size_t position_ = 0;
  std::uint32_t value_ = 0;
  std::uint32_t range_ = 0xFFFFFFFF;
  bool valid_ = false;
};

}  // namespace unimapper::wire
