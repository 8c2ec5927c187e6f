// `unimapper odometry`: poses of a recording, from its scans (and a gyroscope).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/writers.hpp"
#include "src/apps/commands.hpp"
#include "src/apps/input_options.hpp"
#include "src/apps/onboard/input_check.hpp"
#include "src/apps/onboard/onboard_options.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/print.hpp"

namespace unimapper::apps {
namespace {

/// Path and speed of a trajectory.
void print_motion(const std::vector<std::int64_t>& stamps_ns, const std::vector<Pose>& poses) {
  double path_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    path_m += (poses[i].translation - poses[i - 1].translation).norm();
  }
  const double apart_m = (poses.back().translation - poses.front().translation).norm();
  print_to(stdout, "{} poses in {:.1f} s: a path of {:.1f} m, its ends {:.1f} m apart\n",
           poses.size(), static_cast<double>(stamps_ns.back() - stamps_ns.front()) * 1e-9, path_m,
           apart_m);
}

void run_odometry(OnboardOptions options) {
  check_output_file(options.out, options.replaces);
  options.input.own_odometry = true;
  const OpenedInput opened = open_input(options);
  const datasets::Dataset& dataset = *opened.dataset;
  std::vector<std::int64_t> stamps_ns;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    stamps_ns.push_back(dataset.stamp_ns(i));
    poses.push_back(dataset.pose(i));
  }
  datasets::write_tum(options.out, stamps_ns, poses);
  for (const datasets::Note& note : dataset.notes()) {
    print_to(stdout, "{}{}\n", note.is_warning ? "warning: " : "", note.text);
  }
  print_motion(stamps_ns, poses);
}

}  // namespace

void register_odometry(CLI::App& app) {
  auto options = std::make_shared<OnboardOptions>();
  CLI::App* command = app.add_subcommand(
      "odometry", "Poses of a recording, from its scans and a gyroscope, as a TUM file");
  command->add_option("DATASET", options->dataset, "The recording")->required();
  command->add_option("--out", options->out, "New file of poses of the LiDAR: t x y z qx qy qz qw")
      ->required();
  command->add_flag("--replace", options->replaces, "Overwrite that file");
  command->add_option("--scans", options->scans, "Use only the first so many scans")
      ->check(CLI::PositiveNumber);
  add_open_options(*command, options->input);
  command->footer("Example:\n  unimapper odometry drive.mcap --out drive.tum");
  command->callback([options] { run_odometry(*options); });
}

}  // namespace unimapper::apps
