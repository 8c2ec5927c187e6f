// `unimapper evaluate`: the command line of src/apps/evaluate.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "src/apps/commands.hpp"
#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/input_options.hpp"
#include "src/apps/output_guard.hpp"

namespace unimapper::apps {
namespace {

void register_dynamic(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateDynamicOptions>();
  CLI::App* command = evaluate.add_subcommand(
      "dynamic",
      "Static and dynamic accuracy (SA, DA, AA in percent) of a run's labels: per point, and by "
      "DynamicMap_Benchmark's protocol");
  command->add_option("--truth", options->truth, "Dataset with ground-truth labels")->required();
  command->add_option("--run", options->run, "Run folder with labels/")->required();
  add_open_options(*command, options->input);
  command
      ->add_option("--neighbour-m", options->neighbour_m,
                   "Benchmark: a point this near to a kept point counts as kept, metres")
      ->capture_default_str()
      ->check(CLI::Range(0.001F, 10.0F));
  command
      ->add_option("--max-range-m", options->max_range_m,
                   "Benchmark: points at or beyond this range are left out, metres")
      ->capture_default_str()
      ->check(CLI::Range(1.0F, 1000.0F));
  command->add_option("--scans", options->scans, "Only the first scans (default: all)")
      ->check(CLI::PositiveNumber);
  CLI::Option* pictures = command->add_option(
      "--pictures", options->pictures,
      "Folder for pictures of what was kept and removed, and of the worst frames");
  command->add_option("--worst", options->worst, "Frames with pictures of their own")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000))
      ->needs(pictures);
  command->add_flag("--replace", options->replaces, "Overwrite earlier pictures in that folder")
      ->needs(pictures);
  command->footer(
      "Example:\n  unimapper evaluate dynamic --truth recordings/a --run runs/a "
      "--pictures pictures/a");
  command->callback([options] {
    if (!options->pictures.empty()) {
      check_output_folder(options->pictures, Output::kPictures, options->replaces);
    }
    std::cout << evaluate_dynamic(*options);
  });
}

void register_breakdown(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateBreakdownOptions>();
  CLI::App* command = evaluate.add_subcommand(
      "breakdown",
      "A row of a Markdown table by class or range, the points of several results of `evaluate "
      "dynamic` together; without results the table's header");
  command->add_option("results", options->results, "JSON files");
  command->add_option("--by", options->by, "class or range")
      ->capture_default_str()
      ->check(CLI::IsMember({"class", "range"}));
  command->add_option("--label", options->label, "First cell of the row");
  command->footer(
      "Example:\n  unimapper evaluate breakdown --by range --label \"two drives\" a.json b.json");
  command->callback([options] { std::cout << evaluate_breakdown(*options); });
}

void register_loops(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateLoopsOptions>();
  CLI::App* command = evaluate.add_subcommand(
      "loops",
      "Precision and recall of a run's loops, within its session or against an earlier run");
  command->add_option("--run", options->run, "Run folder with loops.csv and keyframes.lcmlog")
      ->required();
  command->add_option("--truth", options->truth, "Dataset of the run")->required();
  CLI::Option* against =
      command->add_option("--against", options->against, "The run that was searched");
  CLI::Option* against_truth = command->add_option("--against-truth", options->against_truth,
                                                   "Its dataset, ground truth in the same world");
  against->needs(against_truth);
  against_truth->needs(against);
  command
      ->add_option("--threshold-m", options->threshold_m, "A true match is at most this far away")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1000.0));
  command
      ->add_option("--min-gap-keyframes", options->min_gap_keyframes,
                   "Within the session: a match is at least this many keyframes earlier")
      ->capture_default_str();
  command->add_flag("--curve", options->curve, "Print the precision-recall curve too");
  command->footer(
      "Example:\n  unimapper evaluate loops --run runs/b --truth recordings/b "
      "--against runs/a --against-truth recordings/a");
  command->callback([options] { std::cout << evaluate_loops(*options); });
}

/// SESSION=FOLDER, each.
SessionTruths named_folders(const char* option, const std::vector<std::string>& texts) {
  SessionTruths folders;
  for (const std::string& text : texts) {
    const std::size_t split = text.find('=');
    if (split == 0 || split == std::string::npos || split + 1 == text.size()) {
      throw CLI::ValidationError(option, "\"" + text + "\" is not SESSION=FOLDER");
    }
    folders.emplace_back(text.substr(0, split), text.substr(split + 1));
  }
  return folders;
}

void register_trajectory(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateTrajectoryOptions>();
  auto truths = std::make_shared<std::vector<std::string>>();
  CLI::App* command = evaluate.add_subcommand(
      "trajectory",
      "Absolute trajectory error of every session; the central one is aligned to its truth once, "
      "the others are not");
  command->add_option("--map", options->map, "Map folder")->required();
  command->add_option("--truth", *truths, "SESSION=DATASET, one for every session to measure")
      ->required()
      ->expected(1, -1);
  command->footer(
      "Example:\n  unimapper evaluate trajectory --map map --truth a=recordings/a "
      "b=recordings/b");
  command->callback([options, truths] {
    options->truths = named_folders("--truth", *truths);
    std::cout << evaluate_trajectory(*options);
  });
}

void register_changes(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateChangesOptions>();
  auto truths = std::make_shared<std::vector<std::string>>();
  CLI::App* command = evaluate.add_subcommand(
      "changes",
      "Precision and recall of the changed objects between two visits to a simulated scene");
  command->add_option("--map", options->map, "Map folder with changes.json")->required();
  command
      ->add_option("--truth", *truths,
                   "SESSION=DATASET of the earlier and of the later visit, with objects.txt")
      ->required()
      ->expected(2);
  command
      ->add_option("--reach-m", options->reach_m,
                   "What was seen from farther away only does not count, metres")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  command->footer(
      "Example:\n  unimapper evaluate changes --map map --truth monday=recordings/monday "
      "tuesday=recordings/tuesday");
  command->callback([options, truths] {
    const SessionTruths visits = named_folders("--truth", *truths);
    options->earlier = visits.front();
    options->later = visits.back();
    std::cout << evaluate_changes(*options);
  });
}

void register_map_view(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateViewOptions>();
  auto truths = std::make_shared<std::vector<std::string>>();
  auto runs = std::make_shared<std::vector<std::string>>();
  CLI::App* command = evaluate.add_subcommand(
      "view",
      "Put the errors of a map into its page: along the paths, of loops, and points with the wrong "
      "label where they are");
  command->add_option("--map", options->map, "Map folder")->required();
  command
      ->add_option("--truth", *truths,
                   "SESSION=DATASET, one for every session to evaluate; all in one world, the "
                   "central session among them")
      ->required()
      ->expected(1, -1);
  command
      ->add_option(
          "--run", *runs,
          "SESSION=FOLDER with the labels to compare: a run folder, or MAP/refined/SESSION")
      ->expected(1, -1);
  command
      ->add_option("--voxel-m", options->voxel_m,
                   "One wrong point of each so large a voxel is shown, metres")
      ->capture_default_str()
      ->check(CLI::Range(0.01F, 10.0F));
  command->add_flag("--replace", options->replaces, "Overwrite an earlier evaluation of the map");
  command->footer(
      "Example:\n  unimapper evaluate view --map map --truth a=recordings/a b=recordings/b "
      "--run a=runs/a b=runs/b");
  command->callback([options, truths, runs] {
    options->truths = named_folders("--truth", *truths);
    options->runs = named_folders("--run", *runs);
    std::cout << evaluate_view(*options);
  });
}

void register_map(CLI::App& evaluate) {
  auto options = std::make_shared<EvaluateMapOptions>();
  CLI::App* command = evaluate.add_subcommand(
      "map", "Agreement of the merged sessions (AC, CD) and entropy of the map (MME)");
  command->add_option("--map", options->map, "Map folder")->required();
  command->add_option("--tau-m", options->tau_m, "Largest distance of corresponding points")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--mme-radius-m", options->mme_radius_m, "Neighbourhood of the entropy")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 50.0));
  command
      ->add_option("--mme-min-neighbours", options->mme_min_neighbours,
                   "Points with fewer neighbours are left out")
      ->capture_default_str()
      ->check(CLI::Range(4, 100000));
  command->footer("Example:\n  unimapper evaluate map --map map");
  command->callback([options] { std::cout << evaluate_map(*options); });
}

}  // namespace

void register_evaluate(CLI::App& app) {
  CLI::App* evaluate =
      app.add_subcommand("evaluate", "Compare runs and maps with the truth; JSON on stdout");
  evaluate->require_subcommand(1);
  register_dynamic(*evaluate);
  register_breakdown(*evaluate);
  register_loops(*evaluate);
  register_trajectory(*evaluate);
  register_map(*evaluate);
  register_map_view(*evaluate);
  register_changes(*evaluate);
}

}  // namespace unimapper::apps
