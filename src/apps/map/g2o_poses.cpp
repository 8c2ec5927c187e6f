#include "src/apps/map/g2o_poses.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "ports/datasets/text.hpp"

namespace unimapper::apps {
namespace {

// Two vertices, a pose and the upper half of a matrix of six by six.
constexpr std::size_t kEdgeColumns = 1 + 2 + 7 + 21;
constexpr std::size_t kVertexColumns = 1 + 1 + 7;

class G2oParser {
 public:
  G2oParser(const std::string& file, std::size_t count) : file_(file), poses_(count) {}

  void take(std::string_view line, std::size_t line_number) {
    number_ = line_number;
    if (!line.empty() && line.front() == '#') return;
    split(line);
    if (columns_.empty()) return;
    const std::string_view tag = columns_[0];
    if (tag == "VERTEX_SE3:QUAT") {
      take_vertex();
    } else if (tag == "EDGE_SE3:QUAT") {
      require_columns(kEdgeColumns);
      (void)vertex(1);
      (void)vertex(2);
      (void)pose(3);
      for (std::size_t i = 10; i < kEdgeColumns; ++i) (void)number(i);
    } else if (tag == "FIX") {
      require_columns(2);
      (void)vertex(1);
    } else {
      fail(datasets::quoted(tag) + " is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX");
    }
  }

  std::vector<Pose> poses() && {
    number_ = 0;
    std::vector<Pose> all;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (!poses_[i]) {
        fail("has no vertex " + std::to_string(i) + "; the map has " +
             std::to_string(poses_.size()) + " keyframes");
      }
      all.push_back(*poses_[i]);
    }
    return all;
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(file_ + (number_ > 0 ? ":" + std::to_string(number_) : "") + ": " +
                             why);
  }

  void split(std::string_view line) {
    constexpr std::string_view kBlank = " \t\r";
    columns_.clear();
    for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;
         begin = line.find_first_not_of(kBlank, begin)) {
      const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
      columns_.push_back(line.substr(begin, end - begin));
      begin = end;
    }
  }

  void require_columns(std::size_t wanted) const {
    if (columns_.size() == wanted) return;
    fail("has " + std::to_string(columns_.size()) + " columns, not " + std::to_string(wanted));
  }

  [[nodiscard]] double number(std::size_t column) const {
    const std::optional<double> value = datasets::to_number(columns_[column]);
    if (!value || !std::isfinite(*value)) {
      fail(datasets::quoted(columns_[column]) + " is no finite number");
    }
    return *value;
  }

  [[nodiscard]] std::size_t vertex(std::size_t column) const {
    const std::string_view text = columns_[column];
    std::size_t value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (read.ec != std::errc() || read.ptr != text.data() + text.size()) {
      fail(datasets::quoted(text) + " is no number of a vertex");
    }
    if (value >= poses_.size()) {
      fail("vertex " + std::to_string(value) + " is of no keyframe; the map has " +
           std::to_string(poses_.size()));
    }
    return value;
  }

  /// x y z qx qy qz qw, from that column on.
  [[nodiscard]] Pose pose(std::size_t column) const {
    const Eigen::Quaterniond q(number(column + 6), number(column + 3), number(column + 4),
                               number(column + 5));
    if (!(std::abs(q.norm() - 1.0) < 1e-3)) fail("qx qy qz qw are no unit quaternion");
    const Eigen::Vector3d t(number(column), number(column + 1), number(column + 2));
    if (!(t.cwiseAbs().maxCoeff() <= 1e8)) fail("the position is out of range");
    return {q, t};
  }

  void take_vertex() {
    require_columns(kVertexColumns);
    std::optional<Pose>& slot = poses_[vertex(1)];
    if (slot) fail("vertex " + std::string(columns_[1]) + " is there twice");
    slot = pose(2);
  }

  const std::string& file_;
  std::size_t number_ = 0;
  std::vector<std::string_view> columns_;
  std::vector<std::optional<Pose>> poses_;
};

}  // namespace

std::vector<Pose> parse_g2o_poses(std::string_view text, const std::string& file,
                                  std::size_t count) {
  G2oParser parser(file, count);
  datasets::for_each_line(
      text, [&](std::string_view line, std::size_t number) { parser.take(line, number); });
  return std::move(parser).poses();
}

}  // namespace unimapper::apps
