// Command-line tool: STD descriptors of every keyframe of a run, written to RUN/std.places.
//
// Like STD itself: from the raw scans, in the odometry frame.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "bench/places/drive.hpp"
#include "bench/places/std_file.hpp"
#include "bench/places/stopwatch.hpp"
#include "ports/datasets/dataset.hpp"
#include "src/merge/parallel.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

StdKeyframe describe_keyframe(const PlaceKeyframe& keyframe, const datasets::Dataset& dataset) {
  StdDescriber describer;
  StdKeyframe described;
  described.sequence = keyframe.sequence;
  datasets::Scan scan;
  std::vector<Eigen::Vector3f> points;
  for (const KeyframeScan& of_keyframe : keyframe.scans) {
    dataset.read_scan(of_keyframe.scan_index, scan);
    points.clear();
    for (const datasets::Scan::Point& p : scan.points) points.emplace_back(p.x, p.y, p.z);
    const double start = thread_milliseconds();
    describer.add_scan(points, of_keyframe.T_odometry_sensor);
    described.milliseconds += thread_milliseconds() - start;
  }
  const double start = thread_milliseconds();
  described.place = describer.describe();
  described.milliseconds += thread_milliseconds() - start;
  return described;
}

void describe_run(const std::filesystem::path& run, const std::filesystem::path& recording) {
  const Drive drive = read_drive_without_truth(run);
  const auto dataset = datasets::open_dataset(recording);
  std::vector<StdKeyframe> described(drive.keyframes.size());
  merge::parallel_for(drive.keyframes.size(), 0, [&](std::size_t i) {
    described[i] = describe_keyframe(drive.keyframes[i], *dataset);
  });
  write_std_file(run / "std.places", described);
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::path run;
  std::filesystem::path recording;
  CLI::App app{"Describes every keyframe of a run the way STD does; writes RUN/std.places."};
  app.add_option("RUN", run)->required()->check(CLI::ExistingDirectory);
  app.add_option("DATASET", recording)->required();
  CLI11_PARSE(app, argc, argv);
  try {
    describe_run(run, recording);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "describe_std: %s\n", error.what());
    return 1;
  }
}
