// Shortest decimal text of a number.
#include "unimapper/core/decimal.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace unimapper {
namespace {

/// Digits of a number, the first one worth ten to the power of `exponent`.
struct Digits {
  std::uint64_t mantissa = 0;
  int count = 0;
  int exponent = 0;
};

int decimal_exponent(double value) noexcept {
  int exponent = 0;
  while (exponent < 308 && value >= scaled_by_ten(1, exponent + 1)) ++exponent;
  while (exponent > -330 && value < scaled_by_ten(1, exponent)) --exponent;
  return exponent;
}

template <typename Number>
Digits shortest_digits(Number value, int most) noexcept {
  const auto exact = static_cast<double>(value);
  Digits digits;
  digits.exponent = decimal_exponent(exact);
  for (digits.count = 1; digits.count <= most; ++digits.count) {
    const int unit = digits.exponent - digits.count + 1;
    const double scaled =
        unit < 0 ? exact * scaled_by_ten(1, -unit) : exact / scaled_by_ten(1, unit);
    digits.mantissa = static_cast<std::uint64_t>(scaled + 0.5);
    if (static_cast<Number>(scaled_by_ten(digits.mantissa, unit)) == value) break;
  }
  digits.count = std::min(digits.count, most);
  if (static_cast<double>(digits.mantissa) >= scaled_by_ten(1, digits.count)) {
    digits.mantissa /= 10;  // 9.99 was rounded up to 10
    ++digits.exponent;
  }
  return digits;
}

void append_digits(std::uint64_t value, int least, DecimalText& text) noexcept {
  char reversed[24];
  int count = 0;
  for (; value != 0 || count < least; value /= 10) {
    reversed[count++] = static_cast<char>('0' + value % 10);
  }
  while (count > 0) text.append({&reversed[--count], 1});
}

void append_scientific(const Digits& digits, DecimalText& text) noexcept {
  DecimalText all;
  append_digits(digits.mantissa, 1, all);
  text.append(leading(all.view(), 1));
  if (all.view().size() > 1) text.append(".").append(without_leading(all.view(), 1));
  text.append(digits.exponent < 0 ? "e-" : "e");
  append_digits(static_cast<std::uint64_t>(std::abs(digits.exponent)), 1, text);
}

void append_plain(const Digits& digits, DecimalText& text) noexcept {
  const int unit = digits.exponent - digits.count + 1;
  DecimalText all;
  append_digits(digits.mantissa, std::max(1, 1 - unit), all);
  const std::size_t fraction = unit < 0 ? static_cast<std::size_t>(-unit) : 0;
  text.append(leading(all.view(), all.view().size() - fraction));
  for (int i = 0; i < unit; ++i) text.append("0");
  if (fraction > 0)
    text.append(".").append(without_leading(all.view(), all.view().size() - fraction));
}

template <typename Number>
DecimalText text_of(Number value, int most) noexcept {
  DecimalText text;
  if (value != value) return text.append("nan");
  if (value < Number{0}) text.append("-");
  const Number magnitude = value < Number{0} ? -value : value;
  if (magnitude == Number{0}) return text.append("0");
  if (magnitude > std::numeric_limits<Number>::max()) return text.append("inf");
  const Digits digits = shortest_digits(magnitude, most);
  const bool plain = digits.exponent >= -5 && digits.exponent <= 15;
  plain ? append_plain(digits, text) : append_scientific(digits, text);
  return text;
}

}  // namespace

DecimalText decimal_of(float value) noexcept { return text_of(value, 9); }

DecimalText decimal_of(double value) noexcept { return text_of(value, 15); }

DecimalText decimal_of(std::uint32_t value) noexcept {
  DecimalText text;
  append_digits(value, 1, text);
  return text;
}

}  // namespace unimapper
