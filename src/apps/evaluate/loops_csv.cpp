// Reader of loops.csv.
#include "src/apps/loops_csv.hpp"

#include <array>
#include <charconv>
#include <fstream>
#include <stdexcept>
#include <string_view>

#include "ports/datasets/poses.hpp"

namespace unimapper::apps {
namespace {

enum Column : std::size_t {
  kQuerySession,
  kQueryKeyframe,
  kQueryScan,
  kMatchSession,
  kMatchKeyframe,
  kMatchScan,
  kConfidence,
  kAccepted,
  kReason,
  kX,
  kY,
  kZ,
  kQx,
  kQy,
  kQz,
  kQw,
  kColumnCount
};

constexpr std::array<std::string_view, kColumnCount> kNames = {"query_session",
                                                               "query_keyframe",
                                                               "query_scan",
                                                               "match_session",
                                                               "match_keyframe",
                                                               "match_scan",
                                                               "confidence",
                                                               "accepted",
                                                               "reason",
                                                               "x",
                                                               "y",
                                                               "z",
                                                               "qx",
                                                               "qy",
                                                               "qz",
                                                               "qw"};

/// Fields of a line; a field in double quotes may hold commas and doubled quotes.
std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

class Reader {
 public:
  explicit Reader(std::filesystem::path file) : file_(std::move(file)), in_(file_) {
    if (!in_) {
      throw std::runtime_error(file_.string() + ": no such file; `unimapper onboard` writes it");
    }
  }

  std::vector<LoopRow> read() {
    std::string line;
    if (!next(line)) fail("is empty; the first line must name the columns");
    read_header(split(line));
    std::vector<LoopRow> rows;
    while (next(line)) {
      if (!line.empty() && line != "\r") rows.push_back(parse(split(line)));
    }
    return rows;
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw std::runtime_error(file_.string() + ":" + std::to_string(line_) + ": " + reason);
  }

  bool next(std::string& line) {
    ++line_;
    return static_cast<bool>(std::getline(in_, line));
  }

  void read_header(const std::vector<std::string>& names) {
    width_ = names.size();
    for (std::size_t c = 0; c < kColumnCount; ++c) {
      std::size_t at = 0;
      while (at < names.size() && names[at] != kNames[c]) ++at;
      if (at == names.size()) fail("has no column \"" + std::string(kNames[c]) + "\"");
      at_[c] = at;
    }
  }

  template <typename T>
  T number(const std::vector<std::string>& fields, Column column) const {
    const std::string& text = fields[at_[column]];
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) {
      fail("\"" + text + "\" is no number for column " + std::string(kNames[column]));
    }
    return value;
  }

  LoopRow parse(const std::vector<std::string>& fields) const {
    if (fields.size() != width_) {
      fail(std::to_string(fields.size()) + " fields, but the header names " +
           std::to_string(width_));
    }
    LoopRow row;
    row.query_session = fields[at_[kQuerySession]];
    row.query_keyframe = number<std::uint32_t>(fields, kQueryKeyframe);
    row.query_scan = number<std::uint32_t>(fields, kQueryScan);
    row.match_session = fields[at_[kMatchSession]];
    row.match_keyframe = number<std::uint32_t>(fields, kMatchKeyframe);
    row.match_scan = number<std::uint32_t>(fields, kMatchScan);
    row.confidence = number<double>(fields, kConfidence);
    row.accepted = number<int>(fields, kAccepted) != 0;
    row.reason = fields[at_[kReason]];
    const auto pose = datasets::pose_from_quaternion(
        number<double>(fields, kX), number<double>(fields, kY), number<double>(fields, kZ),
        number<double>(fields, kQx), number<double>(fields, kQy), number<double>(fields, kQz),
        number<double>(fields, kQw));
    if (!pose) fail("the pose is not a rigid transform");
    row.T_match_query = *pose;
    return row;
  }

  std::filesystem::path file_;
  std::ifstream in_;
  std::size_t line_ = 0;
  std::size_t width_ = 0;
  std::array<std::size_t, kColumnCount> at_{};
};

}  // namespace

std::vector<LoopRow> read_loops_csv(const std::filesystem::path& file) {
  return Reader(file).read();
}

}  // namespace unimapper::apps
