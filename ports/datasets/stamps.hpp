// Time stamps in text and in names of files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace unimapper::datasets {

inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

/// Unit of stamps in a text file. `kAuto`: seconds, but for whole numbers nanoseconds,
/// microseconds or milliseconds where `unit_of_stamps` says so.
enum class StampUnit : std::uint8_t { kAuto, kNanoseconds };

/// Nanoseconds in the unit that whole-numbered stamps of a moving sensor are in: as times since
/// 1970 between 2001 and 2065, else as a plausible step from one to the next (0.5 ms to 0.5 s).
/// `stamps` are in order of time.
[[nodiscard]] std::int64_t unit_of_stamps(const std::vector<std::int64_t>& stamps);

/// Seconds written as digits with an optional fraction, in nanoseconds: exact, which a double is
/// not for today's Unix times. Empty if written any other way.
[[nodiscard]] std::optional<std::int64_t> parse_plain_seconds(std::string_view text);

/// The stamps of a text file, one text each, in nanoseconds. Throws DatasetError with the line.
[[nodiscard]] std::vector<std::int64_t> parse_stamps(const std::vector<std::string_view>& texts,
                                                     const std::vector<std::size_t>& lines,
                                                     const std::filesystem::path& file,
                                                     StampUnit unit);

/// `YYYY-MM-DD hh:mm:ss.fraction` (KITTI raw) in nanoseconds since 1970; empty if it is not of
/// that form.
[[nodiscard]] std::optional<std::int64_t> parse_date(std::string_view date, std::string_view time);

/// Number at the end of a file's stem, behind what the names may begin with.
struct NumberInName {
  /// What stands before the number.
  std::string_view prefix;
  /// The number itself.
  std::string_view digits;
};

/// "scan_0012.pcd.bin": "scan_" and "0012". Empty `digits` if the stem does not end in a number.
/// `stem` is `stem_of` a file.
[[nodiscard]] NumberInName number_in_name(std::string_view stem);

/// The name of a file without its extensions: "12.pcd" of 12.pcd.bin is "12", "1.5.bin" is "1.5".
[[nodiscard]] std::string stem_of(const std::filesystem::path& file);

/// The stamps that the names of `files` hold, in nanoseconds: whole numbers of nine digits or more
/// in ns, us or ms; seconds with a point; seconds and nanoseconds with `_` or `-` in between.
/// Empty where the names hold none. One a file, in the order of `files`.
[[nodiscard]] std::optional<std::vector<std::int64_t>> stamps_of_names(
    const std::vector<std::filesystem::path>& files);

/// `nanoseconds` as seconds with three decimals, for messages.
[[nodiscard]] std::string seconds_text(std::int64_t nanoseconds);

}  // namespace unimapper::datasets
