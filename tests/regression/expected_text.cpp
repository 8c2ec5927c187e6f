#include "expected_text.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

namespace unimapper::regression {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostLinesShown = 80;
constexpr std::size_t kMostLinesCompared = 3000;

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

/// Lengths of the longest common subsequences of the two texts' ends.
std::vector<std::vector<std::uint16_t>> common_ends(const std::vector<std::string>& a,
                                                    const std::vector<std::string>& b) {
  std::vector<std::vector<std::uint16_t>> common(a.size() + 1,
                                                 std::vector<std::uint16_t>(b.size() + 1, 0));
  for (std::size_t i = a.size(); i-- > 0;) {
    for (std::size_t j = b.size(); j-- > 0;) {
      common[i][j] = a[i] == b[j] ? static_cast<std::uint16_t>(common[i + 1][j + 1] + 1)
                                  : std::max(common[i + 1][j], common[i][j + 1]);
    }
  }
  return common;
}

}  // namespace

std::string difference(const std::string& expected, const std::string& actual) {
  std::vector<std::string> a = lines_of(expected);
  std::vector<std::string> b = lines_of(actual);
  a.resize(std::min(a.size(), kMostLinesCompared));
  b.resize(std::min(b.size(), kMostLinesCompared));
  const auto common = common_ends(a, b);
  std::string result;
  std::size_t shown = 0;
  const auto show = [&](const char* sign, std::size_t line, const std::string& text) {
    if (++shown > kMostLinesShown) return;
    result += sign + std::to_string(line + 1) + ": " + text + "\n";
  };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() || j < b.size()) {
    if (i < a.size() && j < b.size() && a[i] == b[j]) {
      ++i;
      ++j;
    } else if (i < a.size() && (j == b.size() || common[i + 1][j] >= common[i][j + 1])) {
      show("- ", i, a[i]);
      ++i;
    } else {
      show("+ ", j, b[j]);
      ++j;
    }
  }
  if (shown > kMostLinesShown) {
    result += "... and " + std::to_string(shown - kMostLinesShown) + " lines more\n";
  }
  return result;
}

namespace {

#ifdef UNIMAPPER_SANITIZED
constexpr bool kExactly = false;
#else
constexpr bool kExactly = true;
#endif

bool starts_number(const char* at) {
  return std::isdigit(static_cast<unsigned char>(*at)) != 0 ||
         (*at == '-' && std::isdigit(static_cast<unsigned char>(at[1])) != 0);
}

/// The largest number of a line.
double largest_number(const std::string& line) {
  double largest = 0.0;
  for (const char* at = line.c_str(); *at != '\0';) {
    char* end = nullptr;
    if (starts_number(at)) largest = std::max(largest, std::abs(std::strtod(at, &end)));
    at = end == nullptr ? at + 1 : end;
  }
  return largest;
}

/// Whether lines are the same but for numbers that differ by little.
bool are_nearly_equal_lines(const std::string& expected, const std::string& line) {
  constexpr double kAbsolute = 0.02;  // metres and degrees
  constexpr double kRelative = 2e-3;
  // Information matrices, counts of refined cells and moments of clouds are sums that poses shift
  // by whole terms: a share of the line's largest.
  const auto holds = [&](const char* word) { return expected.find(word) != std::string::npos; };
  const bool holds_sums = holds("EDGE_SE3") || holds("refined") || holds("spread");
  const double allowed = holds_sums ? 0.01 * largest_number(expected) : kAbsolute;
  const char* a = expected.c_str();
  const char* b = line.c_str();
  while (*a != '\0' && *b != '\0') {
    if (starts_number(a) && starts_number(b)) {
      char* end_a = nullptr;
      char* end_b = nullptr;
      const double of_a = std::strtod(a, &end_a);
      const double of_b = std::strtod(b, &end_b);
      if (std::abs(of_a - of_b) > allowed + kRelative * std::abs(of_a)) return false;
      a = end_a;
      b = end_b;
    } else if (*a++ != *b++) {
      return false;
    }
  }
  return *a == *b;
}

bool are_equal(const std::string& expected, const std::string& text) { return expected == text; }

bool are_nearly_equal(const std::string& expected, const std::string& text) {
  const std::vector<std::string> a = lines_of(expected);
  const std::vector<std::string> b = lines_of(text);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), &are_nearly_equal_lines);
}

void check(const std::string& name, const std::string& text,
           bool (*agree)(const std::string&, const std::string&)) {
  const fs::path expected_file = fs::path(UNIMAPPER_EXPECTED_DIR) / (name + ".txt");
  const char* update = std::getenv("UNIMAPPER_UPDATE_EXPECTED");
  if (update != nullptr && *update == '1') {
    write(expected_file, text);
    WARN("written: " << expected_file.string());
    return;
  }
  const fs::path actual_file = fs::path(UNIMAPPER_ACTUAL_DIR) / (name + ".txt");
  write(actual_file, text);
  std::ifstream file(expected_file, std::ios::binary);
  const std::string expected{std::istreambuf_iterator<char>(file),
                             std::istreambuf_iterator<char>()};
  INFO("expected: " << expected_file.string() << "\nfound: " << actual_file.string()
                    << "\nIf the change is meant: ./dev expected, and read the difference.\n"
                    << difference(expected, text));
  CHECK(agree(expected, text));
}

}  // namespace

void check_expected(const std::string& name, const std::string& text) {
  check(name, text, &are_equal);
}

void check_expected_of_optimisation(const std::string& name, const std::string& text) {
  check(name, text, kExactly ? &are_equal : &are_nearly_equal);
}

}  // namespace unimapper::regression
