#include "ports/datasets/text_encoding.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/text.hpp"

namespace unimapper::datasets {
namespace {

/// UTF-16 with the given byte first in every unit of ASCII.
std::string from_utf16(std::string_view bytes, bool is_big_endian) {
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    const char high = bytes[is_big_endian ? i : i + 1];
    const char low = bytes[is_big_endian ? i + 1 : i];
    text += high == '\0' && static_cast<unsigned char>(low) < 0x80 ? low : '?';
  }
  return text;
}

/// Whether text without a mark is UTF-16: text of numbers has a zero in every unit.
bool looks_like_utf16(std::string_view bytes, bool is_big_endian) {
  constexpr std::size_t kLooked = 256;
  const std::size_t count = std::min(bytes.size(), kLooked) / 2 * 2;
  for (std::size_t i = 0; i < count; i += 2) {
    const bool is_ascii =
        (bytes[is_big_endian ? i : i + 1] == '\0') && (bytes[is_big_endian ? i + 1 : i] != '\0');
    if (!is_ascii) return false;
  }
  return count >= 4;
}

std::string decoded(std::string bytes) {
  constexpr std::string_view kUtf8 = "\xef\xbb\xbf";
  constexpr std::string_view kUtf16Little = "\xff\xfe";
  constexpr std::string_view kUtf16Big = "\xfe\xff";
  if (bytes.starts_with(kUtf8)) return bytes.substr(kUtf8.size());
  if (bytes.starts_with(kUtf16Little)) return from_utf16(std::string_view(bytes).substr(2), false);
  if (bytes.starts_with(kUtf16Big)) return from_utf16(std::string_view(bytes).substr(2), true);
  if (looks_like_utf16(bytes, false)) return from_utf16(bytes, false);
  if (looks_like_utf16(bytes, true)) return from_utf16(bytes, true);
  return bytes;
}

bool is_digit_at(std::string_view text, std::size_t i) {
  return i < text.size() && text[i] >= '0' && text[i] <= '9';
}

/// What the commas of a file are.
struct Commas {
  bool may_be_decimal = true;
  bool is_any = false;
  bool has_other_separator = false;  ///< in a line with commas
  bool is_alone = true;              ///< every line is one column with one comma
};

void look_at_column(std::string_view column, Commas& commas) {
  constexpr std::size_t kMostDecimals = 17;  // of a double
  std::size_t count = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    const bool is_within = i > 0 && is_digit_at(column, i - 1) && is_digit_at(column, i + 1);
    if (column[i] == '.' && (is_digit_at(column, i + 1) || (i > 0 && is_digit_at(column, i - 1)))) {
      commas.may_be_decimal = false;
    }
    if (column[i] != ',') continue;
    ++count;
    // As many digits as a stamp in nanoseconds has: a second column of whole numbers.
    if (column.size() - i - 1 > kMostDecimals) commas.is_alone = false;
    if (!is_within) commas.may_be_decimal = false;
  }
  if (count > 1) commas.may_be_decimal = false;
  if (count != 1) commas.is_alone = false;
  commas.is_any = commas.is_any || count > 0;
}

void look_at_line(std::string_view line, Commas& commas) {
  constexpr std::string_view kSeparators = " \t;\"\r";
  std::size_t columns = 0;
  bool has_comma = false;
  while (commas.may_be_decimal && !line.empty()) {
    const std::size_t end = std::min(line.find_first_of(kSeparators), line.size());
    if (end > 0) {
      ++columns;
      has_comma = has_comma || line.substr(0, end).find(',') != std::string_view::npos;
      look_at_column(line.substr(0, end), commas);
    }
    line.remove_prefix(std::min(end + 1, line.size()));
  }
  if (columns > 1) commas.is_alone = false;
  commas.has_other_separator = commas.has_other_separator || (has_comma && columns > 1);
}

}  // namespace

std::string plain_text(std::string bytes) {
  std::string text = decoded(std::move(bytes));
  // Old systems end a line with \r alone.
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  if (text.find(',') == std::string::npos) return text;
  Commas commas;
  for_each_line(text, [&](std::string_view line, std::size_t /*number*/) {
    const std::string_view content = without_comment(line);
    // A header's names may have any comma.
    const std::size_t first = content.find_first_not_of(" \t;,\"\r");
    if (first == std::string_view::npos) return;
    const bool is_number = is_digit_at(content, first) || content[first] == '-' ||
                           content[first] == '+' || content[first] == '.';
    if (is_number) look_at_line(content, commas);
  });
  if (commas.may_be_decimal && commas.is_any && (commas.has_other_separator || commas.is_alone)) {
    std::replace(text.begin(), text.end(), ',', '.');
  }
  return text;
}

std::string read_text(const std::filesystem::path& file) {
  std::string bytes = read_file(file);
  for (const auto& [begin, remedy] :
       {std::pair{"\x1f\x8b", "compressed: unpack with `gunzip`"},
        std::pair{"\x28\xb5\x2f\xfd", "compressed: unpack with `unzstd`"},
        std::pair{"PK\x03\x04",
                  "a ZIP archive or a spreadsheet: unpack it, or export it as CSV"}}) {
    if (bytes.starts_with(begin)) fail(file, remedy);
  }
  return plain_text(std::move(bytes));
}

}  // namespace unimapper::datasets
