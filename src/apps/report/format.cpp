// Number and text formatting for reports.
#include "src/apps/report/format.hpp"

#include <fmt/format.h>

#include <cmath>

namespace unimapper::apps {

std::string fixed(double value, int digits) {
  if (!std::isfinite(value)) return "\u2013";
  return fmt::format("{:.{}f}", value, digits);
}

std::string grouped(std::uint64_t value) {
  const std::string digits = std::to_string(value);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += "\u202f";
    text += digits[i];
  }
  return text;
}

std::string short_count(std::uint64_t value) {
  if (value < 10'000) return grouped(value);
  const auto scaled = [value](double unit, const char* suffix) {
    const double figure = static_cast<double>(value) / unit;
    return fixed(figure, figure < 10.0 ? 2 : figure < 100.0 ? 1 : 0) + "\u00a0" + suffix;
  };
  return value < 1'000'000 ? scaled(1e3, "k") : scaled(1e6, "M");
}

std::string length(double metres) {
  if (!std::isfinite(metres)) return "\u2013";
  if (metres >= 1000.0) return fixed(metres / 1000.0, 2) + "\u00a0km";
  const int digits = metres < 1.0 ? 3 : metres < 10.0 ? 2 : metres < 100.0 ? 1 : 0;
  return fixed(metres, digits) + "\u00a0m";
}

std::string percent(double share, int digits) { return fixed(100.0 * share, digits); }

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

}  // namespace unimapper::apps
