#include "src/apps/evaluate/pictures.hpp"

#include <algorithm>
#include <string_view>

#include "ports/datasets/writers.hpp"
#include "src/apps/evaluate/range_image.hpp"
#include "src/apps/evaluate/top_view.hpp"
#include "src/apps/evaluate/worst_table.hpp"
#include "src/evaluate/worst_frames.hpp"

namespace unimapper::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTopViewPixels = 1400;
constexpr double kTopViewMetresPerPixel = 0.1;
// Half a second: long enough for a walker to move visibly, short enough to stay in view.
constexpr std::size_t kScansBetween = 5;

void write_png(const fs::path& file, const Image& image) {
  const std::vector<std::uint8_t> png = encode_png(image);
  datasets::write_text(file,
                       std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
}

/// Frame around the whole drive, from a sample of its points.
Frame whole_drive(LabelledRun& run) {
  constexpr std::size_t kEveryScan = 5;
  constexpr std::size_t kPointsOfScan = 2000;
  Extent extent;
  for (std::size_t s = 0; s < run.scan_count(); s += kEveryScan) {
    const evaluate::ScoredScan scan = run.scan(s);
    extent.add_path(scan.T_world_sensor.translation.x(), scan.T_world_sensor.translation.y());
    const std::size_t step = std::max<std::size_t>(1, scan.points.size() / kPointsOfScan);
    for (std::size_t i = 0; i < scan.points.size(); i += step) {
      const Eigen::Vector3d p = scan.T_world_sensor * scan.points[i].cast<double>();
      extent.add_scenery(p.x(), p.y());
    }
  }
  return extent.fit(kTopViewPixels, kTopViewMetresPerPixel);
}

Image draw_whole_drive(LabelledRun& run) {
  TopView view(whole_drive(run), 1);
  for (std::size_t s = 0; s < run.scan_count(); ++s) view.add(run.scan(s));
  return view.paint();
}

/// The scan whose objects are compared with those of `scan`: earlier if there is one.
std::size_t scan_to_compare(std::size_t scan, std::size_t scans) {
  if (scan >= kScansBetween) return scan - kScansBetween;
  return std::min(scan + kScansBetween, scans - 1);
}

std::vector<FrameObject> wrong_objects(LabelledRun& run, std::size_t scan) {
  const auto other = evaluate::errors_by_object(run.scan(scan_to_compare(scan, run.scan_count())));
  std::vector<FrameObject> objects;
  for (const evaluate::ObjectErrors& errors : evaluate::errors_by_object(run.scan(scan))) {
    if (errors.tally.wrong() == 0) break;
    objects.push_back({errors, evaluate::displacement_m(errors, other)});
  }
  return objects;
}

WorstFrame write_frame(LabelledRun& run, std::size_t number, const evaluate::DynamicScore& score,
                       const fs::path& directory) {
  const std::string name = run.scan_name(number);
  WorstFrame frame{name,
                   number,
                   score,
                   wrong_objects(run, number),
                   "frame_" + name + "_range.png",
                   "frame_" + name + "_top.png"};
  const evaluate::ScoredScan scan = run.scan(number);
  write_png(directory / frame.range_image, draw_range_image(scan));
  TopView view = TopView::around(scan.T_world_sensor);
  view.add(scan);
  write_png(directory / frame.top_view, view.paint());
  return frame;
}

}  // namespace

void write_pictures(LabelledRun& run, const fs::path& directory, std::size_t worst) {
  datasets::make_directory(directory);
  write_png(directory / "top_view.png", draw_whole_drive(run));
  const std::vector<evaluate::DynamicScore> scores = evaluate::score_frames(run);
  std::vector<WorstFrame> frames;
  for (const std::size_t number : evaluate::worst_frames(scores, worst)) {
    frames.push_back(write_frame(run, number, scores[number], directory));
  }
  datasets::write_text(directory / "worst.md", worst_markdown(frames, kScansBetween));
  datasets::write_text(directory / "worst.json", worst_json(frames, kScansBetween));
}

}  // namespace unimapper::apps
