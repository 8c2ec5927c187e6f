#include "ports/store/health_reader.hpp"

#include <charconv>
#include <string_view>

#include "ports/store/store_file.hpp"

namespace unimapper::store {
namespace {

/// What stands before the next separator; `text` goes on behind it.
std::string_view next_part(std::string_view& text, char separator) {
  const std::size_t end = text.find(separator);
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return part;
}

/// Lines of tab-separated fields as `HealthHistory` writes them; figures that are none are left
/// out.
std::vector<HealthDetail> details_in(std::string_view text) {
  std::vector<HealthDetail> details;
  while (!text.empty()) {
    std::string_view line = next_part(text, '\n');
    HealthDetail& detail = details.emplace_back();
    detail.kind = next_part(line, '\t');
    detail.name = next_part(line, '\t');
    while (!line.empty()) {
      const std::string_view field = next_part(line, '\t');
      double value = 0.0;
      const auto read = std::from_chars(field.data(), field.data() + field.size(), value);
      if (read.ec == std::errc()) detail.figures.push_back(value);
    }
  }
  return details;
}

}  // namespace

std::vector<HealthRow> read_health(const std::filesystem::path& folder, std::int64_t since_s) {
  const Database database = open_for_reading(folder);
  Statement rows(database,
                 "SELECT session, received_s, scans, keyframes, bytes_sent, deadline_misses, "
                 "details FROM health WHERE received_s >= ? ORDER BY session, received_s");
  rows.bind(since_s);
  std::vector<HealthRow> history;
  while (rows.step()) {
    HealthRow& row = history.emplace_back();
    row.session = rows.number(0);
    row.received_s = rows.number(1);
    row.scans = rows.number(2);
    row.keyframes = rows.number(3);
    row.bytes_sent = rows.number(4);
    row.deadline_misses = rows.number(5);
    row.details = details_in(rows.text(6));
  }
  return history;
}

}  // namespace unimapper::store
