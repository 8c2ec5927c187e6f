// Writer of loops.csv.
#include <charconv>

#include "src/apps/loops_csv.hpp"

namespace unimapper::apps {
namespace {

std::string number(double value) {
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

void append_row(std::string& text, const LoopRow& row) {
  text += quoted_if_needed(row.query_session) + ',' + std::to_string(row.query_keyframe) + ',' +
          std::to_string(row.query_scan) + ',';
  text += quoted_if_needed(row.match_session) + ',' + std::to_string(row.match_keyframe) + ',' +
          std::to_string(row.match_scan) + ',';
  text += number(row.confidence) + (row.accepted ? ",1," : ",0,") + quoted_if_needed(row.reason);
  const Eigen::Vector3d& t = row.T_match_query.translation;
  const Eigen::Quaterniond q = row.T_match_query.quaternion();
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
    text += ',' + number(value);
  }
  text += '\n';
}

}  // namespace

std::string format_loops_csv(std::span<const LoopRow> rows) {
  std::string text =
      "query_session,query_keyframe,query_scan,match_session,match_keyframe,match_scan,"
      "confidence,accepted,reason,x,y,z,qx,qy,qz,qw\n";
  for (const LoopRow& row : rows) append_row(text, row);
  return text;
}

}  // namespace unimapper::apps
