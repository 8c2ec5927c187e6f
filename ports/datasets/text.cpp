#include "ports/datasets/text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets {

namespace {

bool is_separator(char c) {
  return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '"' || c == '\r' || c == '\0';
}

}  // namespace

Columns split_columns(std::string_view line) {
  Columns columns;
  for (std::size_t i = 0; i < line.size();) {
    if (is_separator(line[i])) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < line.size() && !is_separator(line[end])) ++end;
    if (columns.count < Columns::kMost) columns.text[columns.count] = line.substr(i, end - i);
    ++columns.count;
    i = end;
  }
  return columns;
}

std::string_view without_comment(std::string_view line) {
  // "%time" is a header of rostopic.
  const std::string_view text = line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
  if (text.starts_with("//") || text.starts_with("% ")) return {line.data(), 0};
  return line.substr(0, line.find('#'));
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kShown = 32;
  std::string shown = "'";
  for (const char c : text.substr(0, kShown)) shown += c >= ' ' && c <= '~' ? c : '?';
  return shown + (text.size() > kShown ? "...'" : "'");
}

std::optional<double> to_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

double parse_number(std::string_view text, const std::filesystem::path& file, std::size_t line) {
  const auto value = to_number(text);
  if (!value) fail_at_line(file, line, quoted(text) + " is not a number");
  if (!std::isfinite(*value)) fail_at_line(file, line, quoted(text) + " is not finite");
  return *value;
}

}  // namespace unimapper::datasets
