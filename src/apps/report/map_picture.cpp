// Top views of a merged map.
#include "src/apps/report/map_picture.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "src/apps/picture/image.hpp"
#include "src/apps/picture/palette.hpp"
#include "src/apps/picture/raster.hpp"

namespace unimapper::apps {
namespace {

constexpr std::size_t kPicturePixels = 600;
constexpr double kFinestMetresPerPixel = 0.08;
/// Spacing of the unified map's points.
constexpr double kMapPointM = static_cast<double>(merge::MapConfig{}.voxel_size_m);
constexpr std::size_t kMaxRefusedLoops = 300;

using merge::LoopConstraint;
using merge::MergedSession;

bool is_connected(const MergedSession& session) { return merge::is_in_map(session.status); }

/// Brightness by the number of points above each other: walls stand out from the ground in every
/// colour.
void paint(Image& image, const Layer& layer, float dimming) {
  const float high = std::max(2.0F, layer.quantile(0.98));
  for (std::size_t y = 0; y < image.height(); ++y) {
    for (std::size_t x = 0; x < image.width(); ++x) {
      const std::size_t pixel = y * image.width() + x;
      const float amount = layer.amount(pixel);
      if (amount <= 0.0F) continue;
      const float stack = std::clamp(std::log(std::max(1.0F, amount)) / std::log(high), 0.0F, 1.0F);
      const float tone = dimming * (0.34F + 0.66F * stack);
      image.at(x, y) =
          mix(image.at(x, y), layer.color(pixel) * tone, std::min(1.0F, 1.4F * amount));
    }
  }
}

/// Blends `marks` over the picture, by their share among the points of `map` in each pixel.
void overlay(Image& image, const Layer& marks, const Layer& map, float strength) {
  for (std::size_t y = 0; y < image.height(); ++y) {
    for (std::size_t x = 0; x < image.width(); ++x) {
      const std::size_t pixel = y * image.width() + x;
      const float amount = marks.amount(pixel);
      if (amount <= 0.0F) continue;
      // One layer of ground is below everything and does not count.
      const float others = std::max(0.0F, map.amount(pixel) - 1.0F);
      const float share = amount / (amount + 0.5F * others);
      image.at(x, y) =
          mix(image.at(x, y), marks.color(pixel), std::min(0.95F, strength * amount) * share);
    }
  }
}

/// The frame of the unified map.
Frame map_frame(const merge::MergeResult& result) {
  Extent extent;
  for (const merge::MapPoint& point : result.map) {
    extent.add_scenery(static_cast<double>(point.position.x()),
                       static_cast<double>(point.position.y()));
  }
  for (const MergedSession& session : result.sessions) {
    if (!is_connected(session)) continue;
    for (const Pose& pose : session.T_map_keyframe) {
      extent.add_path(pose.translation.x(), pose.translation.y());
    }
  }
  return extent.fit(kPicturePixels, kFinestMetresPerPixel);
}

void add_point(Layer& layer, const Eigen::Vector3f& p, const Rgb& color) {
  layer.add(static_cast<double>(p.x()), static_cast<double>(p.y()), kMapPointM, color);
}

/// An SVG drawing over a picture; coordinates are the picture's pixels.
class Drawing {
 public:
  Drawing(const Image& image, const Frame& frame, const std::string& label) : frame_(frame) {
    out_.precision(1);
    out_ << std::fixed;
    out_ << "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"" << label
         << "\" viewBox=\"0 0 " << frame.width << ' ' << frame.height << "\"><image width=\""
         << frame.width << "\" height=\"" << frame.height << "\" href=\"data:image/png;base64,"
         << base64(encode_png(image)) << "\"/>";
  }

  /// A path with a dark outline and a ring at its start.
  void path(const std::vector<Pose>& poses, const Rgb& color) {
    if (poses.empty()) return;
    const std::string points = polyline(poses);
    const double unit = line_unit();
    out_ << "<g fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\">"
         << "<polyline points=\"" << points << "\" stroke=\"#000\" stroke-opacity=\".65\""
         << " stroke-width=\"" << 5.0 * unit << "\"/><polyline points=\"" << points
         << "\" stroke=\"" << hex(mix(color, {1, 1, 1}, 0.25F)) << "\" stroke-width=\""
         << 2.2 * unit << "\"/></g>";
    const Eigen::Vector2d start = at(poses.front());
    out_ << "<circle cx=\"" << start.x() << "\" cy=\"" << start.y() << "\" r=\"" << 6.0 * unit
         << "\" fill=\"#0c1016\" stroke=\"" << hex(mix(color, {1, 1, 1}, 0.25F))
         << "\" stroke-width=\"" << 2.6 * unit << "\"/>";
  }

  void loop(const Pose& a, const Pose& b, bool accepted) {
    const Eigen::Vector2d from = at(a);
    const Eigen::Vector2d to = at(b);
    const double unit = line_unit();
    out_ << "<line x1=\"" << from.x() << "\" y1=\"" << from.y() << "\" x2=\"" << to.x()
         << "\" y2=\"" << to.y() << "\" stroke=\"" << hex(accepted ? kAcceptedColor : kRefusedColor)
         << "\" stroke-width=\"" << (accepted ? 1.5 : 1.0) * unit << '"';
    if (!accepted) out_ << " stroke-opacity=\".45\" stroke-dasharray=\"" << 6.0 * unit << "\"";
    out_ << "/>";
  }

  /// A bar of a round length near a sixth of the width, bottom left.
  void scale_bar() {
    const double target = frame_.metres_per_pixel * static_cast<double>(frame_.width) / 6.0;
    double metres = std::pow(10.0, std::floor(std::log10(target)));
    if (metres * 5.0 <= target) {
      metres *= 5.0;
    } else if (metres * 2.0 <= target) {
      metres *= 2.0;
    }
    const double unit = line_unit();
    const double x = 24.0 * unit;
    const double y = static_cast<double>(frame_.height) - 24.0 * unit;
    const double end = x + metres / frame_.metres_per_pixel;
    out_ << "<g stroke=\"#fff\" stroke-width=\"" << 2.4 * unit << "\"><path fill=\"none\" d=\"M"
         << x << ' ' << y - 8.0 * unit << "V" << y << "H" << end << "V" << y - 8.0 * unit
         << "\"/></g><text x=\"" << 0.5 * (x + end) << "\" y=\"" << y - 12.0 * unit
         << "\" fill=\"#fff\" stroke=\"#000\" stroke-opacity=\".6\" paint-order=\"stroke\""
         << " stroke-width=\"" << 3.0 * unit << "\" font-size=\"" << 20.0 * unit
         << "\" text-anchor=\"middle\">";
    if (metres < 1.0) out_ << metres << " m</text>";
    if (metres >= 1.0) out_ << static_cast<long>(metres + 0.5) << " m</text>";
  }

  std::string finish() {
    out_ << "</svg>";
    return out_.str();
  }

 private:
  /// About one CSS pixel when the picture fills the page's column.
  [[nodiscard]] double line_unit() const { return static_cast<double>(frame_.width) / 1150.0; }

  [[nodiscard]] Eigen::Vector2d at(const Pose& pose) const {
    return frame_.pixel(pose.translation.x(), pose.translation.y());
  }

  /// Steps shorter than two pixels are left out.
  [[nodiscard]] std::string polyline(const std::vector<Pose>& poses) const {
    std::ostringstream points;
    points.precision(1);
    points << std::fixed;
    Eigen::Vector2d last(-1e9, -1e9);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Eigen::Vector2d p = at(poses[i]);
      if ((p - last).norm() < 2.0 && i + 1 < poses.size()) continue;
      points << p.x() << ',' << p.y() << ' ';
      last = p;
    }
    return points.str();
  }

  Frame frame_;
  std::ostringstream out_;
};

/// Loops of connected sessions, refused ones first (so that accepted ones lie on top), and of
/// the refused ones the most confident only.
std::vector<const LoopConstraint*> loops_to_draw(const merge::MergeResult& result) {
  std::vector<const LoopConstraint*> refused;
  std::vector<const LoopConstraint*> accepted;
  for (const LoopConstraint& loop : result.loops) {
    const MergedSession& query = result.sessions[loop.query.session];
    const MergedSession& match = result.sessions[loop.match.session];
    if (!is_connected(query) || !is_connected(match)) continue;
    if (loop.query.keyframe >= query.T_map_keyframe.size()) continue;
    if (loop.match.keyframe >= match.T_map_keyframe.size()) continue;
    (loop.decision.accepted ? accepted : refused).push_back(&loop);
  }
  std::stable_sort(refused.begin(), refused.end(),
                   [](const LoopConstraint* a, const LoopConstraint* b) {
                     return a->confidence > b->confidence;
                   });
  if (refused.size() > kMaxRefusedLoops) refused.resize(kMaxRefusedLoops);
  refused.insert(refused.end(), accepted.begin(), accepted.end());
  return refused;
}

void draw_paths(Drawing& drawing, const merge::MergeResult& result) {
  for (std::size_t s = 0; s < result.sessions.size(); ++s) {
    if (is_connected(result.sessions[s])) {
      drawing.path(result.sessions[s].T_map_keyframe, session_color(s));
    }
  }
}

}  // namespace

std::string draw_map(const ReportInput& input) {
  const merge::MergeResult& result = *input.result;
  const Frame frame = map_frame(result);
  Image image(frame.width, frame.height, kPictureBackground);
  Layer map(frame);
  for (const merge::MapPoint& point : result.map) {
    add_point(map, point.position,
              point.sessions_seen > 1 ? kSharedColor : session_color(point.session));
  }
  paint(image, map, 1.0F);
  Layer dynamic(frame);
  for (const Eigen::Vector3f& p : result.dynamic_points) add_point(dynamic, p, kDynamicColor);
  overlay(image, dynamic, map, 0.45F);
  Drawing drawing(image, frame, "The merged map from above");
  for (const LoopConstraint* loop : loops_to_draw(result)) {
    drawing.loop(result.sessions[loop->query.session].T_map_keyframe[loop->query.keyframe],
                 result.sessions[loop->match.session].T_map_keyframe[loop->match.keyframe],
                 loop->decision.accepted);
  }
  draw_paths(drawing, result);
  drawing.scale_bar();
  return drawing.finish();
}

}  // namespace unimapper::apps
