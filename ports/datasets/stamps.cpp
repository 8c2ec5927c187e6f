#include "ports/datasets/stamps.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

#include "ports/datasets/files.hpp"
#include "ports/datasets/text.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kPerMicrosecond_ns = 1000;
constexpr std::int64_t kPerMillisecond_ns = 1'000'000;

bool is_digits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

std::optional<std::int64_t> to_whole(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Median difference of neighbours; 0 for fewer than two stamps.
std::int64_t median_step(const std::vector<std::int64_t>& stamps) {
  std::vector<std::uint64_t> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    // Unsigned: the difference of two foreign stamps may not fit.
    const auto [low, high] = std::minmax(stamps[i - 1], stamps[i]);
    steps.push_back(static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low));
  }
  if (steps.empty()) return 0;
  return static_cast<std::int64_t>(
      std::min<std::uint64_t>(median(std::span(steps)), std::numeric_limits<std::int64_t>::max()));
}

/// `value` in units of `unit_ns`; empty where that does not fit.
std::optional<std::int64_t> scaled(std::int64_t value, std::int64_t unit_ns) {
  std::int64_t result = 0;
  if (__builtin_mul_overflow(value, unit_ns, &result)) return std::nullopt;
  return result;
}

std::int64_t parse_seconds(std::string_view text, const fs::path& file, std::size_t line) {
  if (const auto plain = parse_plain_seconds(text)) return *plain;
  const double seconds = parse_number(text, file, line);
  constexpr double kLimitSeconds = 9.0e9;
  if (std::abs(seconds) > kLimitSeconds) {
    fail_at_line(file, line, quoted(text) + " is out of range for a time in seconds");
  }
  return std::llround(seconds * 1e9);
}

}  // namespace

std::int64_t unit_of_stamps(const std::vector<std::int64_t>& stamps) {
  if (stamps.empty()) return 1;
  // Seconds since 1970 of the years 2001 to 2065.
  constexpr std::int64_t kSince = 1'000'000'000;
  constexpr std::int64_t kUntil = 3'000'000'000;
  const std::int64_t step = median_step(stamps);
  const auto is_date_in = [&](std::int64_t unit_ns) {
    const std::int64_t per_second = kNanosecondsPerSecond / unit_ns;
    // A clock that counts smaller units since its start may show the same number, but not with
    // steps of less than 20 seconds in this unit.
    return stamps.back() / per_second >= kSince && stamps.back() / per_second < kUntil &&
           step < 20 * per_second;
  };
  for (const std::int64_t unit_ns :
       {std::int64_t{1}, kPerMicrosecond_ns, kPerMillisecond_ns, kNanosecondsPerSecond}) {
    if (is_date_in(unit_ns)) return unit_ns;
  }
  constexpr std::int64_t kLeastStep_ns = 500'000;
  if (step >= kLeastStep_ns) return 1;
  if (step >= kLeastStep_ns / kPerMicrosecond_ns) return kPerMicrosecond_ns;
  if (step >= 2) return kPerMillisecond_ns;
  return kNanosecondsPerSecond;
}

std::optional<std::int64_t> parse_plain_seconds(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  constexpr std::size_t kMaxSecondDigits = 10;  // keeps the result far from overflow
  const std::size_t point = std::min(text.find('.'), text.size());
  std::string_view whole = text.substr(0, point);
  while (whole.size() > 1 && whole.front() == '0') whole.remove_prefix(1);
  if (whole.size() > kMaxSecondDigits || !is_digits(whole)) return std::nullopt;
  std::int64_t value = to_whole(whole).value_or(0);
  if (value > std::numeric_limits<std::int64_t>::max() / kNanosecondsPerSecond - 1) {
    return std::nullopt;
  }
  value *= kNanosecondsPerSecond;
  std::int64_t unit = kNanosecondsPerSecond / 10;
  for (std::size_t i = point + 1; i < text.size(); ++i, unit /= 10) {
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    value += (text[i] - '0') * unit;
  }
  return negative ? -value : value;
}

std::vector<std::int64_t> parse_stamps(const std::vector<std::string_view>& texts,
                                       const std::vector<std::size_t>& lines, const fs::path& file,
                                       StampUnit unit) {
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(texts.size());
  // Whole numbers beyond any time in seconds are counts of a smaller unit.
  constexpr std::size_t kMaxSecondDigits = 10;
  const bool are_counts =
      unit == StampUnit::kNanoseconds ||
      (!texts.empty() && texts.back().size() > kMaxSecondDigits &&
       std::all_of(texts.begin(), texts.end(), [](auto t) { return to_whole(t).has_value(); }));
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (!are_counts) {
      stamps_ns.push_back(parse_seconds(texts[i], file, lines[i]));
      continue;
    }
    const auto count = to_whole(texts[i]);
    if (!count) {
      fail_at_line(file, lines[i], quoted(texts[i]) + " is not a stamp in whole nanoseconds");
    }
    stamps_ns.push_back(*count);
  }
  if (unit == StampUnit::kNanoseconds || !are_counts) return stamps_ns;
  const std::int64_t unit_ns = unit_of_stamps(stamps_ns);
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    const auto nanoseconds = scaled(stamps_ns[i], unit_ns);
    if (!nanoseconds) fail_at_line(file, lines[i], quoted(texts[i]) + " is out of range");
    stamps_ns[i] = *nanoseconds;
  }
  return stamps_ns;
}

std::optional<std::int64_t> parse_date(std::string_view date, std::string_view time) {
  const auto number = [](std::string_view text, std::size_t at, std::size_t digits) {
    const auto part = text.substr(std::min(at, text.size()), digits);
    return part.size() == digits && is_digits(part) ? to_whole(part) : std::nullopt;
  };
  const auto year = number(date, 0, 4);
  const auto month = number(date, 5, 2);
  const auto day = number(date, 8, 2);
  const auto hour = number(time, 0, 2);
  const auto minute = number(time, 3, 2);
  if (!year || !month || !day || !hour || !minute || date.size() != 10 || time.size() < 8) {
    return std::nullopt;
  }
  const auto seconds = parse_plain_seconds(time.substr(6));
  const std::chrono::year_month_day calendar{std::chrono::year(static_cast<int>(*year)),
                                             std::chrono::month(static_cast<unsigned>(*month)),
                                             std::chrono::day(static_cast<unsigned>(*day))};
  if (!seconds || !calendar.ok() || *year < 1900 || *year > 2200) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(calendar).time_since_epoch().count();
  return ((days * 24 + *hour) * 60 + *minute) * 60 * kNanosecondsPerSecond + *seconds;
}

std::string stem_of(const fs::path& file) {
  std::string stem = file.stem().string();
  for (const std::string_view inner : {".pcd", ".ply", ".velodyne"}) {
    if (lower_case(stem).ends_with(inner)) return stem.substr(0, stem.size() - inner.size());
  }
  return stem;
}

NumberInName number_in_name(std::string_view stem) {
  std::size_t begin = stem.size();
  while (begin > 0 && stem[begin - 1] >= '0' && stem[begin - 1] <= '9') --begin;
  return {stem.substr(0, begin), stem.substr(begin)};
}

namespace {

/// Parts of "1691936557_123456789", "12.5" or "1691936557123456789".
struct NameParts {
  std::string_view prefix;
  std::string_view whole;
  char separator = '\0';
  std::string_view fraction;
};

NameParts parts_of(std::string_view stem) {
  const NumberInName last = number_in_name(stem);
  if (last.digits.empty() || last.prefix.empty()) return {last.prefix, last.digits, '\0', {}};
  const char separator = last.prefix.back();
  const NumberInName first = number_in_name(last.prefix.substr(0, last.prefix.size() - 1));
  // Ten digits are seconds since 1970: "scan_1_000012" is a numbered scan.
  const bool is_pair = separator == '.' ? !first.digits.empty()
                                        : (separator == '_' || separator == '-') &&
                                              first.digits.size() == 10 && last.digits.size() <= 9;
  if (!is_pair) return {last.prefix, last.digits, '\0', {}};
  return {first.prefix, first.digits, separator, last.digits};
}

std::optional<std::vector<std::int64_t>> whole_stamps(const std::vector<NameParts>& names) {
  std::vector<std::int64_t> stamps;
  for (const NameParts& name : names) {
    const auto count = to_whole(name.whole);
    if (!count) return std::nullopt;
    stamps.push_back(*count);
  }
  constexpr std::int64_t kLeast = 100'000'000;  // nine digits: no recording has as many scans
  std::vector<std::int64_t> sorted = stamps;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.back() < kLeast) return std::nullopt;
  const std::int64_t unit_ns = unit_of_stamps(sorted);
  for (std::int64_t& stamp : stamps) {
    const auto nanoseconds = scaled(stamp, unit_ns);
    if (!nanoseconds) return std::nullopt;
    stamp = *nanoseconds;
  }
  return stamps;
}

/// Seconds and, behind `_` or `-`, a count of nanoseconds that may lack leading zeros; of
/// microseconds if none has more than six digits.
std::optional<std::vector<std::int64_t>> paired_stamps(const std::vector<NameParts>& names) {
  std::size_t digits = 0;
  for (const NameParts& name : names) digits = std::max(digits, name.fraction.size());
  constexpr std::size_t kMicrosecondDigits = 6;
  const std::int64_t unit_ns = digits > kMicrosecondDigits ? 1 : kPerMicrosecond_ns;
  std::vector<std::int64_t> stamps;
  for (const NameParts& name : names) {
    std::optional<std::int64_t> stamp;
    if (name.separator == '.') {
      stamp =
          parse_plain_seconds({name.whole.data(), name.whole.size() + 1 + name.fraction.size()});
    } else if (const auto seconds = parse_plain_seconds(name.whole)) {
      stamp = *seconds + unit_ns * to_whole(name.fraction).value_or(0);
    }
    if (!stamp) return std::nullopt;
    stamps.push_back(*stamp);
  }
  return stamps;
}

}  // namespace

std::optional<std::vector<std::int64_t>> stamps_of_names(const std::vector<fs::path>& files) {
  if (files.empty()) return std::nullopt;
  std::vector<std::string> stems;
  stems.reserve(files.size());
  for (const fs::path& file : files) stems.push_back(stem_of(file));
  std::vector<NameParts> names;
  for (const std::string& stem : stems) {
    names.push_back(parts_of(stem));
    const NameParts& first = names.front();
    const NameParts& name = names.back();
    if (name.whole.empty() || name.prefix != first.prefix || name.separator != first.separator) {
      return std::nullopt;
    }
  }
  return names.front().separator == '\0' ? whole_stamps(names) : paired_stamps(names);
}

std::string seconds_text(std::int64_t nanoseconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(nanoseconds) * 1e-9);
  return text;
}

}  // namespace unimapper::datasets
