// Tests of the pictures of a run.
#include <png.h>

#include <nlohmann/json.hpp>

#include "ports/datasets/files.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/outcome_raster.hpp"
#include "src/apps/evaluate/range_image.hpp"
#include "src/apps/evaluate/top_view.hpp"
#include "src/apps/picture/palette.hpp"
#include "tests/evaluate/labelled_scan.hpp"
#include "tests/evaluate/small_folders.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::evaluate::testing;
using namespace unimapper::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace fs = std::filesystem;

namespace {

bool is(const Rgb& a, const Rgb& b) {
  // A picture has 8 bits a channel.
  const auto near = [](float x, float y) { return std::abs(x - y) < 0.003F; };
  return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue);
}

std::size_t count(const Image& image, const Rgb& color) {
  std::size_t pixels = 0;
  for (std::size_t y = 0; y < image.height(); ++y) {
    for (std::size_t x = 0; x < image.width(); ++x) pixels += is(image.at(x, y), color) ? 1 : 0;
  }
  return pixels;
}

Image read_png(const fs::path& file) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&header, file.c_str()) != 0);
  header.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(header));
  REQUIRE(png_image_finish_read(&header, nullptr, bytes.data(), 0, nullptr) != 0);
  Image image(header.width, header.height, {});
  for (std::size_t i = 0; i < bytes.size() / 3; ++i) {
    const auto channel = [&](std::size_t c) { return static_cast<float>(bytes[3 * i + c]) / 255; };
    image.at(i % header.width, i / header.width) = {channel(0), channel(1), channel(2)};
  }
  return image;
}

/// A drive past a wall and two walkers; the run decides every point rightly but in scans that
/// `label` changes.
class Drive {
 public:
  explicit Drive(std::size_t scans) {
    write_dataset(folder_.path(), std::vector<Pose>(scans),
                  {{10, 0, 0, 0}, {10, 5, 0, 0}, {0, 20, 0, 0}, {-20, 0, 1, 0}},
                  {kWall, kWall, kWalker, kWalker});
    write_run_labels(folder_ / "run", scans, {kKept, kKept, kRemoved, kRemoved});
  }
  void label(std::size_t scan, const std::vector<std::uint32_t>& labels) {
    datasets::write_labels(folder_ / ("run/labels/" + scan_name(scan) + ".label"), labels);
  }
  /// Writes the pictures, returns worst.json.
  Json draw(std::size_t worst = 10) {
    EvaluateDynamicOptions options{folder_.path(), folder_ / "run"};
    options.pictures = pictures();
    options.worst = worst;
    (void)evaluate_dynamic(options);
    return Json::parse(datasets::read_file(pictures() / "worst.json"));
  }
  [[nodiscard]] fs::path pictures() const { return folder_ / "pictures"; }

 private:
  TemporaryDirectory folder_;
};

}  // namespace

TEST_CASE("a point's outcome compares the run's label with the truth") {
  CHECK(outcome_of(kWall, kKept) == Outcome::kKept);
  CHECK(outcome_of(kWall, kRemoved) == Outcome::kLost);
  CHECK(outcome_of(kWalker, kRemoved) == Outcome::kRemoved);
  CHECK(outcome_of(kWalker, kKept) == Outcome::kMissed);
  CHECK(outcome_of(0, kRemoved) == Outcome::kIgnored);
}

TEST_CASE("a mistake stays visible under any number of other points") {
  OutcomeRaster raster(3, 1);
  for (const Outcome outcome : {Outcome::kMissed, Outcome::kKept, Outcome::kLost}) {
    raster.mark(0, 0, 1, 1, outcome, 1.0F);
  }
  raster.mark(1, 0, 1, 1, Outcome::kLost, 0.0F);
  raster.mark(1, 0, 1, 1, Outcome::kRemoved, 1.0F);
  raster.mark(-5, -5, 100, 1, Outcome::kMissed, 1.0F);  // outside
  const Image image = raster.paint();
  CHECK(is(image.at(0, 0), kMissedColor));
  CHECK(is(image.at(1, 0), kLostColor));
  CHECK(is(image.at(2, 0), kPictureBackground));
}

TEST_CASE("kept points are grey, and brighter the higher they are") {
  OutcomeRaster raster(2, 1);
  raster.mark(0, 0, 1, 1, Outcome::kKept, 0.2F);
  raster.mark(1, 0, 1, 1, Outcome::kKept, 0.9F);
  raster.mark(1, 0, 1, 1, Outcome::kKept, 0.1F);
  const Image image = raster.paint();
  CHECK(image.at(0, 0).green < image.at(1, 0).green);
}

TEST_CASE("the view from above has north up and the sensor in the middle") {
  LabelledScan scan;
  scan.add({0, 20, 0}, kWalker, kKept);
  scan.add({30, 0, 0}, kWall, kRemoved);
  scan.T_world_sensor.translation = {1000, -500, 3};
  TopView view = TopView::around(scan.T_world_sensor);
  view.add(scan.scored());
  const Image image = view.paint();
  REQUIRE(image.width() == 1000);
  CHECK(is(image.at(500, 300), kMissedColor));
  CHECK(is(image.at(800, 500), kLostColor));
  CHECK(count(image, kMissedColor) == 9);
}

TEST_CASE("the range image has left on the left and up on top") {
  LabelledScan scan;
  scan.add({10, 10, 0}, kWalker, kKept);
  scan.add({10, -10, 0}, kWall, kRemoved);
  scan.add({10, 0, 5}, kWalker, kRemoved);
  scan.add({10, 0, -5}, kWall, kKept);
  const Image image = draw_range_image(scan.scored());
  const auto first_column = [&](const Rgb& color) {
    for (std::size_t x = 0; x < image.width(); ++x) {
      for (std::size_t y = 0; y < image.height(); ++y) {
        if (is(image.at(x, y), color)) return x;
      }
    }
    return image.width();
  };
  CHECK(first_column(kMissedColor) == 0);
  CHECK(first_column(kLostColor) == image.width() - 1);
  CHECK(is(image.at(image.width() / 2, 0), kRemovedColor));
  CHECK(draw_range_image(LabelledScan{}.scored()).width() == 1);
}

TEST_CASE("pictures of a run show its missed point and its lost point") {
  Drive drive(1);
  drive.label(0, {kRemoved, kKept, kKept, kRemoved});
  const Json json = drive.draw();
  const Image whole = read_png(drive.pictures() / "top_view.png");
  CHECK(count(whole, kMissedColor) == 1);
  CHECK(count(whole, kLostColor) == 1);
  CHECK(count(whole, kRemovedColor) == 1);
  for (const char* name : {"frame_000000_range.png", "frame_000000_top.png"}) {
    const Image image = read_png(drive.pictures() / name);
    CHECK(count(image, kMissedColor) > 0);
    CHECK(count(image, kLostColor) > 0);
  }
  const Json& frame = json["frames"][0];
  CHECK(frame["false_static"] == 1);
  CHECK(frame["false_dynamic"] == 1);
  CHECK(frame["by_class"]["pedestrian"]["false_static"] == 1);
  CHECK(frame["by_class"]["building"]["false_dynamic"] == 1);
  CHECK(frame["by_range_m"]["20-30"]["false_static"] == 1);
  CHECK(frame["by_range_m"]["10-20"]["false_dynamic"] == 1);
  CHECK_THAT(datasets::read_file(drive.pictures() / "worst.md"),
             Contains("frame_000000_range.png") && Contains("pedestrian 7 | missed 1 of 2"));
}

TEST_CASE("the worst frames get pictures, the worst one first, and no others") {
  Drive drive(31);
  drive.label(3, {kRemoved, kKept, kRemoved, kRemoved});
  drive.label(15, {kRemoved, kRemoved, kKept, kRemoved});
  drive.label(16, {kRemoved, kRemoved, kRemoved, kRemoved});  // as good as its neighbour
  drive.label(30, {kKept, kKept, kKept, kKept});
  Json json = drive.draw();
  REQUIRE(json["frames"].size() == 3);
  CHECK(json["frames"][0]["scan"] == "000015");
  CHECK(json["frames"][1]["scan"] == "000030");
  CHECK(json["frames"][2]["scan"] == "000003");
  CHECK_FALSE(fs::exists(drive.pictures() / "frame_000016_top.png"));
  fs::remove_all(drive.pictures());
  CHECK(drive.draw(1)["frames"].size() == 1);
  CHECK_FALSE(fs::exists(drive.pictures() / "frame_000030_top.png"));
}

TEST_CASE("a run without mistakes has a view from above and an empty table") {
  Drive drive(2);
  CHECK(drive.draw()["frames"].empty());
  CHECK(count(read_png(drive.pictures() / "top_view.png"), kMissedColor) == 0);
}
