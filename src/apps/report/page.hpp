// HTML elements of a report.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace unimapper::apps {

/// A table whose columns hold text (left) or figures (right).
class Table {
 public:
  /// Column titles; a title that starts with '#' marks a column of figures.
  explicit Table(const std::vector<std::string>& titles);
  /// Cells are HTML already.
  void row(const std::vector<std::string>& cells);
  [[nodiscard]] std::string html() const;

 private:
  std::vector<bool> figures_;
  std::string head_;
  std::string body_;
};

/// Coloured marks with their meanings; colours are CSS values.
[[nodiscard]] std::string legend(const std::vector<std::pair<std::string, std::string>>& entries);

/// The style element of a report.
[[nodiscard]] std::string report_style();

}  // namespace unimapper::apps
