// Numbers in columns of text files.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace unimapper::datasets {

/// The columns of a line, separated by blanks, tabs, commas, semicolons or quotes.
struct Columns {
  /// Columns of a line that are looked at.
  static constexpr std::size_t kMost = 96;
  /// Of each column; the first `count` are set.
  std::array<std::string_view, kMost> text;
  std::size_t count = 0;  ///< may exceed kMost; the surplus is not kept
};

/// Splits a line.
[[nodiscard]] Columns split_columns(std::string_view line);

/// `line` up to its `#`.
[[nodiscard]] std::string_view without_comment(std::string_view line);

/// Calls `consume(line, number)` for every line, without its line break; lines count from 1.
template <typename Consume>
void for_each_line(std::string_view text, const Consume& consume) {
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    consume(text.substr(0, end), number);
    text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
  }
}

/// Calls `consume(columns, number)` for every line that is not blank or a comment.
template <typename Consume>
void for_each_row(std::string_view text, const Consume& consume) {
  for_each_line(text, [&](std::string_view line, std::size_t number) {
    const Columns columns = split_columns(without_comment(line));
    if (columns.count > 0) consume(columns, number);
  });
}

/// The start of foreign text in quotes, safe for a terminal.
[[nodiscard]] std::string quoted(std::string_view text);

/// A whole text as a number, NaN and infinity included; empty if it is none.
[[nodiscard]] std::optional<double> to_number(std::string_view text);

/// A whole text as a finite number. Throws DatasetError with file and line.
[[nodiscard]] double parse_number(std::string_view text, const std::filesystem::path& file,
                                  std::size_t line);

}  // namespace unimapper::datasets
