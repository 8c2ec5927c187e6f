// Reader and writer of loops.csv.
#include "loops_csv.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "export_files.hpp"

namespace unimapper::merge {
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

class LoopsCsvReader {
 public:
  explicit LoopsCsvReader(std::filesystem::path file) : file_(std::move(file)), in_(file_) {
    if (!in_) {
      throw std::runtime_error(file_.string() + ": no such file; `unimapper onboard` writes it");
    }
  }

  std::vector<LoopRecord> read() {
    std::string line;
    if (!next(line)) fail("is empty; the first line must name the columns");
    read_header(split(line));
    std::vector<LoopRecord> loops;
    while (next(line)) {
      if (!line.empty() && line != "\r") loops.push_back(parse(split(line)));
    }
    return loops;
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

  LoopRecord parse(const std::vector<std::string>& fields) const {
    if (fields.size() != width_) {
      fail(std::to_string(fields.size()) + " fields, but the header names " +
           std::to_string(width_));
    }
    LoopRecord loop;
    loop.query_session = fields[at_[kQuerySession]];
    loop.query_keyframe = number<std::uint32_t>(fields, kQueryKeyframe);
    loop.query_scan = number<std::uint32_t>(fields, kQueryScan);
    loop.match_session = fields[at_[kMatchSession]];
    loop.match_keyframe = number<std::uint32_t>(fields, kMatchKeyframe);
    loop.match_scan = number<std::uint32_t>(fields, kMatchScan);
    loop.confidence = number<double>(fields, kConfidence);
    loop.accepted = number<int>(fields, kAccepted) != 0;
    loop.reason = fields[at_[kReason]];
    loop.T_match_query = pose(fields);
    return loop;
  }

  Pose pose(const std::vector<std::string>& fields) const {
    const auto value = [&](Column column) { return number<double>(fields, column); };
    const Eigen::Quaterniond q(value(kQw), value(kQx), value(kQy), value(kQz));
    Pose T(q, Eigen::Vector3d(value(kX), value(kY), value(kZ)));
    constexpr double kLengthTolerance = 1e-2;
    if (!(std::abs(q.norm() - 1.0) < kLengthTolerance) || !T.is_rigid()) {
      fail("the pose is not a rigid transform");
    }
    return T;
  }

  std::filesystem::path file_;
  std::ifstream in_;
  std::size_t line_ = 0;
  std::size_t width_ = 0;
  std::array<std::size_t, kColumnCount> at_{};
};

std::string text_of(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

std::string quoted_if_needed(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string quoted = "\"";
  for (const char c : field) {
    if (c == '"') quoted += '"';
    quoted += c == '\n' || c == '\r' ? ' ' : c;
  }
  return quoted + '"';
}

void append_row(std::string& text, const LoopRecord& loop) {
  text += quoted_if_needed(loop.query_session) + ',' + std::to_string(loop.query_keyframe) + ',' +
          std::to_string(loop.query_scan) + ',';
  text += quoted_if_needed(loop.match_session) + ',' + std::to_string(loop.match_keyframe) + ',' +
          std::to_string(loop.match_scan) + ',';
  text += text_of(loop.confidence) + (loop.accepted ? ",1," : ",0,");
  text += quoted_if_needed(loop.reason);
  const Eigen::Vector3d& t = loop.T_match_query.translation;
  const Eigen::Quaterniond q = canonical_quaternion(loop.T_match_query);
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    text += ',' + text_of(value);
  }
  text += '\n';
}

}  // namespace

std::vector<LoopRecord> read_loops_csv(const std::filesystem::path& file) {
  return LoopsCsvReader(file).read();
}

std::string format_loops_csv(std::span<const LoopRecord> loops) {
  std::string text;
  for (const std::string_view name : kNames) (text += name) += ',';
  text.back() = '\n';
  for (const LoopRecord& loop : loops) append_row(text, loop);
  return text;
}

}  // namespace unimapper::merge
