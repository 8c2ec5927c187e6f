#include "bench/places/options.hpp"

#include <CLI/CLI.hpp>
#include <map>

namespace unimapper::bench {

bool parse_options(int argc, char** argv, PlacesOptions& options, int& exit_code) {
  CLI::App app{
      "Place recognition across LiDARs: places of other routes are searched for in drives of "
      "route A, by our database and by STD. Prints Markdown tables."};
  app.add_option("SCENE", options.scenes,
                 "Folders of drives, SCENE/<sensor>-<route>, each with keyframes.lcmlog, "
                 "gt_poses.txt and, for STD, std.places")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--title", options.title, "Title of the tables");
  app.add_option("--sensors", options.sensors, "LiDARs, from the richest to the poorest")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--routes", options.routes, "Routes of the queries")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--config", options.config, "Parameters as JSON, as for unimapper onboard")
      ->check(CLI::ExistingFile);
  app.add_option("--variants", options.variants,
                 "JSON list of variants; the first gets all tables, the others a summary")
      ->check(CLI::ExistingFile);
  app.add_option("--out", options.out, "Folder for figures, curves and plot data as CSV");
  app.add_option("--distance", options.row.near_m, "Positives by distance, metres")
      ->capture_default_str();
  app.add_option("--distractors", options.distractors,
                 "Run folders through other scenes, whose places are added to those of route A "
                 "(not for STD)")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--ablations-only", options.ablations_only,
               "Only the table of variants, no CSV files");
  app.add_flag("--same", options.same_only, "Only rows of one LiDAR");
  const std::map<std::string, BaselineRows> baselines{
      {"none", BaselineRows::kNone}, {"same", BaselineRows::kSame}, {"all", BaselineRows::kAll}};
  app.add_option("--baseline-rows", options.baseline, "Rows that STD is scored on, too")
      ->transform(CLI::CheckedTransformer(baselines));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error);
    return false;
  }
  if (options.title.empty()) options.title = options.scenes.front().filename().string();
  return true;
}

}  // namespace unimapper::bench
