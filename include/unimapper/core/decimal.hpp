// Decimal numbers as text, without heap, locale or C++ runtime.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace unimapper {

/// The first `count` characters, or all. `std::string_view::substr` throws, which costs firmware
/// the C++ runtime.
[[nodiscard]] constexpr std::string_view leading(std::string_view text,
                                                 std::size_t count) noexcept {
  return {text.data(), count < text.size() ? count : text.size()};
}
/// What follows the first `count` characters.
[[nodiscard]] constexpr std::string_view without_leading(std::string_view text,
                                                         std::size_t count) noexcept {
  text.remove_prefix(count < text.size() ? count : text.size());
  return text;
}

/// Text of bounded length, always terminated by zero; what does not fit is left out.
template <std::size_t Capacity>
class BoundedText {
 public:
  /// Characters, the terminating zero among them.
  static constexpr std::size_t kCapacity = Capacity;

  constexpr BoundedText() noexcept = default;
  /// Appends what fits; the rest is cut off.
  constexpr BoundedText& append(std::string_view text) noexcept {
    for (const char c : text) {
      if (size_ + 1 == Capacity) break;
      text_[size_++] = c;
    }
    text_[size_] = '\0';
    return *this;
  }
  /// The text so far, valid as long as the object.
  [[nodiscard]] constexpr std::string_view view() const noexcept { return {text_, size_}; }
  /// The text, terminated by a zero.
  [[nodiscard]] constexpr const char* c_str() const noexcept { return text_; }
  /// Whether nothing more fits; text may have been cut off.
  [[nodiscard]] constexpr bool full() const noexcept { return size_ + 1 == Capacity; }

 private:
  char text_[Capacity]{};
  std::size_t size_ = 0;
};

/// `mantissa` times ten to the power of `exponent`; correctly rounded where the mantissa is below
/// 2^53 and the exponent within 22, else to within a few units in the last digit.
[[nodiscard]] constexpr double scaled_by_ten(std::uint64_t mantissa, int exponent) noexcept {
  constexpr double kExact[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                               1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                               1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  double value = static_cast<double>(mantissa);
  for (; exponent > 22; exponent -= 22) value *= 1e22;
  for (; exponent < -22; exponent += 22) value /= 1e22;
  return exponent < 0 ? value / kExact[-exponent] : value * kExact[exponent];
}

/// The number that a text such as "-1", "0.25" or "1e-9" stands for; nothing for any other text and
/// for what is no finite double.
[[nodiscard]] constexpr std::optional<double> parse_decimal(std::string_view text) noexcept {
  std::size_t at = 0;
  const auto digit = [&] { return at < text.size() && text[at] >= '0' && text[at] <= '9'; };
  const auto skip = [&](char c) { return at < text.size() && text[at] == c && (++at, true); };
  const bool negative = skip('-');
  std::uint64_t mantissa = 0;
  int exponent = 0;
  std::size_t digits = 0;
  const auto read_digits = [&](int weight) {
    for (; digit(); ++at, ++digits) {
      constexpr std::uint64_t kFull = 1'000'000'000'000'000'000;  // room for one more digit
      const bool fits = mantissa < kFull;
      if (fits) mantissa = mantissa * 10 + static_cast<std::uint64_t>(text[at] - '0');
      exponent += weight + (fits ? 0 : 1);
    }
  };
  read_digits(0);
  if (skip('.')) read_digits(-1);
  if (digits == 0) return std::nullopt;
  if (skip('e') || skip('E')) {
    const bool down = skip('-');
    if (!down) skip('+');
    if (!digit()) return std::nullopt;
    int power = 0;
    for (; digit(); ++at) power = power > 999 ? power : power * 10 + (text[at] - '0');
    exponent += down ? -power : power;
  }
  if (at != text.size()) return std::nullopt;
  const double value = mantissa == 0 ? 0.0 : scaled_by_ten(mantissa, exponent);
  constexpr double kLargest = 1.7976931348623157e308;
  if (!(value <= kLargest)) return std::nullopt;
  return negative ? -value : value;
}

/// Enough for every number `decimal_of` writes.
using DecimalText = BoundedText<40>;

/// The shortest text that `parse_decimal` reads back as the same float.
[[nodiscard]] DecimalText decimal_of(float value) noexcept;
/// The shortest text that `parse_decimal` reads back as the same double, of at most 15 significant
/// digits.
[[nodiscard]] DecimalText decimal_of(double value) noexcept;
[[nodiscard]] DecimalText decimal_of(std::uint32_t value) noexcept;

}  // namespace unimapper
