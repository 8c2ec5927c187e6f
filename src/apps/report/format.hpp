// Number and text formatting for reports.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace unimapper::apps {

/// `value` with `digits` after the point; "–" if it is not finite.
[[nodiscard]] std::string fixed(double value, int digits);
/// A count in groups of three: "1 234 567", the gaps narrow and unbreakable.
[[nodiscard]] std::string grouped(std::uint64_t value);
/// A count with three significant digits: "842", "373 k", "2.58 M".
[[nodiscard]] std::string short_count(std::uint64_t value);
/// A length with three significant digits: "0.082 m", "12.3 m", "1.25 km".
[[nodiscard]] std::string length(double metres);
/// A share in [0, 1] as percent with `digits` after the point, without the sign.
[[nodiscard]] std::string percent(double share, int digits);
/// Text made safe for HTML.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace unimapper::apps
