#include "expected_text.hpp"

#include <cctype>

#include "tests/test.hpp"
#include "words.hpp"

namespace unimapper::regression {

namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// The lines that one text alone has: "-" before those of `expected`, "+" before those of `actual`.
std::string difference(const std::string& expected, const std::string& actual) {
  constexpr std::size_t kMostShown = 80;
  std::string result;
  std::size_t shown = 0;
  const auto show = [&](const char* sign, const std::string& text, const std::string& other) {
    std::map<std::string, int> there;
    for (const std::string& line : lines_of(other)) ++there[line];
    std::size_t number = 0;
    for (const std::string& line : lines_of(text)) {
      ++number;
      if (there[line]-- > 0 || ++shown > kMostShown) continue;
      result += sign + std::to_string(number) + ": " + line + "\n";
    }
  };
  show("- ", expected, actual);
  show("+ ", actual, expected);
  if (shown > kMostShown) {
    result += "... and " + std::to_string(shown - kMostShown) + " lines more\n";
  }
  return result;
}

bool is_part_of_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
}

/// Whether a number begins at a place of a line; "16" of "vlp-16" is part of a word.
bool starts_number(const std::string& line, std::size_t at) {
  if (at > 0 && is_part_of_word(line[at - 1])) return false;
  const std::size_t digit = line[at] == '-' ? at + 1 : at;
  return digit < line.size() && std::isdigit(static_cast<unsigned char>(line[digit])) != 0;
}

/// A line with `#` in place of its numbers, and the numbers.
struct MaskedLine {
  std::string words;
  std::vector<double> numbers;
};

MaskedLine mask(const std::string& line) {
  MaskedLine masked;
  for (std::size_t at = 0; at < line.size();) {
    if (!starts_number(line, at)) {
      masked.words += line[at++];
      continue;
    }
    char* end = nullptr;
    const double number = std::strtod(line.c_str() + at, &end);
    auto after = static_cast<std::size_t>(end - line.c_str());
    masked.words += '#';
    if (after < line.size() && is_part_of_word(line[after])) {
      // A checksum: its digits are a word.
      while (after < line.size() && is_part_of_word(line[after])) ++after;
    } else {
      masked.numbers.push_back(number);
    }
    at = after;
  }
  return masked;
}

/// Lines with equal words: how many, and the sums of their numbers by place.
struct LineKind {
  std::string words;
  std::size_t lines = 0;
  std::vector<double> sums;
};

std::vector<LineKind> kinds_of(const std::string& text) {
  std::vector<LineKind> kinds;
  std::map<std::string, std::size_t> place;
  for (const std::string& line : lines_of(text)) {
    const MaskedLine masked = mask(line);
    const auto [found, is_new] = place.try_emplace(masked.words, kinds.size());
    if (is_new) kinds.push_back({masked.words, 0, std::vector<double>(masked.numbers.size(), 0.0)});
    LineKind& kind = kinds[found->second];
    ++kind.lines;
    const std::size_t numbers = std::min(kind.sums.size(), masked.numbers.size());
    for (std::size_t i = 0; i < numbers; ++i) kind.sums[i] += masked.numbers[i];
  }
  return kinds;
}

std::string summary_line(const LineKind& kind) {
  std::string text = std::to_string(kind.lines) + " x " + kind.words;
  if (!kind.sums.empty()) text += " ; mean";
  for (const double sum : kind.sums) {
    char number[32];
    std::snprintf(number, sizeof number, " %.4g", sum / static_cast<double>(kind.lines));
    text += number;
  }
  return text + "\n";
}

/// Digest of a text, and a line for each of its most frequent kinds of lines.
std::string summary_of(const std::string& text) {
  constexpr std::size_t kMostKinds = 12;
  std::vector<LineKind> kinds = kinds_of(text);
  std::vector<std::size_t> counts;
  for (const LineKind& kind : kinds) counts.push_back(kind.lines);
  std::sort(counts.rbegin(), counts.rend());
  const std::size_t fewest = counts.size() > kMostKinds ? counts[kMostKinds - 1] : 0;
  std::string summary = "digest " + checksum(text) + "\n";
  std::size_t shown = 0;
  std::size_t other_lines = 0;
  for (const LineKind& kind : kinds) {
    if (kind.lines >= fewest && shown < kMostKinds) {
      summary += summary_line(kind);
      ++shown;
    } else {
      other_lines += kind.lines;
    }
  }
  if (other_lines > 0) summary += std::to_string(other_lines) + " other lines\n";
  return summary;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

void check_expected(const std::string& name, const std::string& text) {
  const fs::path expected_file = fs::path(UNIMAPPER_EXPECTED_DIR) / (name + ".txt");
  const fs::path good_file = fs::path(UNIMAPPER_ACTUAL_DIR) / "good" / (name + ".txt");
  const fs::path actual_file = fs::path(UNIMAPPER_ACTUAL_DIR) / (name + ".txt");
  const std::string summary = summary_of(text);
  write(actual_file, text);
  const char* update = std::getenv("UNIMAPPER_UPDATE_EXPECTED");
  if (update != nullptr && *update == '1') {
    write(expected_file, summary);
    write(good_file, text);
    WARN("written: " << expected_file.string());
    return;
  }
  const std::string expected = read(expected_file);
  if (summary == expected) {
    write(good_file, text);
    SUCCEED();
    return;
  }
  const std::string good = read(good_file);
  FAIL_CHECK("expected: " << expected_file.string() << "\nfound: " << actual_file.string()
                          << "\nthe last good one, of an earlier run: " << good_file.string()
                          << "\nIf the change is meant: ./dev expected, and read the difference.\n"
                          << difference(expected, summary) << "\n"
                          << (good.empty() ? std::string() : difference(good, text)));
}

void check_expected_of_optimisation(const std::string& name, const std::string& text) {
#ifdef UNIMAPPER_SANITIZED
  WARN(name << ": " << text.size() << " bytes, not compared in a build with a sanitizer");
#else
  check_expected(name, text);
#endif
}

}  // namespace unimapper::regression
