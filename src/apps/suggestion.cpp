#include "src/apps/suggestion.hpp"

#include <algorithm>

#include "ports/datasets/files.hpp"

namespace unimapper::apps {
namespace {

/// Edit distance (Levenshtein, with exchanged neighbours as one edit).
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1);
  std::vector<std::size_t> last(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({replaced, last[j] + 1, row[j - 1] + 1});
      const bool exchanged = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (exchanged) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = last;
    last = row;
  }
  return last[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view typed, const std::vector<std::string>& known) {
  constexpr std::size_t kLongest = 64;  // nobody mistypes more, and the cost stays bounded
  if (typed.empty() || typed.size() > kLongest) return {};
  const std::string wanted = datasets::lower_case(typed);
  std::string nearest;
  std::size_t fewest = std::max<std::size_t>(wanted.size() / 3, 1) + 1;
  for (const std::string& name : known) {
    const std::string candidate = datasets::lower_case(name);
    constexpr std::size_t kTelling = 3;
    const bool is_beginning = wanted.size() >= kTelling && candidate.starts_with(wanted);
    const std::size_t count = is_beginning ? 1 : edits(wanted, candidate);
    if (count >= fewest) continue;
    fewest = count;
    nearest = name;
  }
  return nearest;
}

std::string did_you_mean(std::string_view typed, const std::vector<std::string>& known) {
  const std::string name = nearest_name(typed, known);
  return name.empty() ? std::string() : "; did you mean '" + name + "'?";
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace unimapper::apps
