// `unimapper merge`: sessions in, map folder and report out.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "ports/datasets/files.hpp"
#include "src/apps/export_options.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/refined_labels.hpp"
#include "src/apps/merge/run_positions.hpp"
#include "src/apps/merge/session_references.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/replacement.hpp"
#include "src/apps/report.hpp"
#include "src/apps/report/run_stats.hpp"
#include "src/apps/report/times.hpp"
#include "src/apps/report/waiting_pairs.hpp"
#include "src/apps/scene/result_scene.hpp"
#include "src/apps/session_clouds.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void write_refined_labels_of_sessions(const MergeOptions& options,
                                      const std::filesystem::path& folder,
                                      const std::vector<SessionData>& sessions,
                                      const merge::MergeResult& result) {
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const std::string& name = sessions[s].info.name;
    for (const auto& [session, dataset] : options.reference.truths) {
      if (session != name) continue;
      const std::size_t without =
          write_refined_labels(folder / "refined" / name, dataset, sessions[s], result.sessions[s]);
      if (without > 0) {
        std::cerr << "unimapper: warning: " << without << " scans of " << name
                  << " are in no whole keyframe: all their points are labelled static\n";
      }
      std::cerr << "unimapper: refined labels of " << name << " are in "
                << (options.out / "refined" / name).string() << '\n';
    }
  }
}

/// Labels are refined in voxels of one size; those of robots with other cells come out worse.
void warn_of_cell_sizes(const std::vector<SessionData>& sessions, float cell_size_m) {
  for (const SessionData& session : sessions) {
    if (session.keyframes.empty() || session.keyframes.front().cell_size_m == cell_size_m) continue;
    std::cerr << "unimapper: warning: the cells of session " << session.info.name
              << " have an edge of " << session.keyframes.front().cell_size_m
              << " m, labels are refined in voxels of " << cell_size_m
              << " m; set refinement.cell_size_m (--config)\n";
  }
}

merge::MergeConfig make_config(const MergeOptions& options) {
  merge::MergeConfig config;
  if (!options.config.empty()) {
    parse_config(datasets::read_file(options.config), options.config.string(), config);
  }
  if (options.threads) config.threads = *options.threads;
  if (options.memory_mb) config.memory_mb = *options.memory_mb;
  return config;
}

/// Positions beside the runs, if a coordinate system is asked for; else says where some are.
merge::UserStatements statements_of(const MergeOptions& options,
                                    const std::vector<SessionData>& sessions,
                                    const std::vector<std::filesystem::path>& runs) {
  merge::UserStatements statements;
  if (!options.output.crs.name.empty()) {
    statements.positions = positions_of_runs(sessions, runs, Projection(options.output.crs.name));
    return statements;
  }
  for (const std::filesystem::path& file : position_files(runs)) {
    std::cerr << "unimapper: " << file.string()
              << " holds positions; --crs places the map by them\n";
  }
  return statements;
}

/// Throws where the map is none, or lacks a session: exit code 0 would pass for success.
void require_result(const MergeOptions& options, const std::vector<SessionData>& sessions,
                    const merge::MergeResult& result) {
  if (result.map.size() == 0) {
    throw std::runtime_error(
        "the map is empty: the sessions hold no static cells; see the warnings of `unimapper "
        "onboard` and the statistics in stats.json");
  }
  if (options.allow_unconnected) return;
  std::string apart;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    if (merge::is_in_map(result.sessions[s].status)) continue;
    apart += (apart.empty() ? "" : ", ") + sessions[s].info.name;
  }
  if (apart.empty()) return;
  throw std::runtime_error("left apart from the map: " + apart +
                           " (the summary says why; the rest is merged). Do they share a part of "
                           "their way? --allow-unconnected takes this for a success");
}

}  // namespace

std::string effective_config(const MergeOptions& options) {
  return dump_config(make_config(options));
}

void run_merge(const MergeOptions& options) {
  check_output_folder(options.out, Output::kMap, options.replaces);
  if (!options.mcap.empty()) check_output_file(options.mcap, options.replaces);
  // Whether they can be written is known before the work.
  FolderReplacement map(options.out, Output::kMap);
  std::optional<FileReplacement> scene;
  if (!options.mcap.empty()) scene.emplace(options.mcap);
  const merge::MergeConfig config = make_config(options);
  merge::ExportOptions output = options.output;
  find_system(output);
  std::vector<SessionData> sessions;
  std::vector<std::filesystem::path> runs;
  StoredContents contents(config.kept_bytes());
  for (auto& input : gather_sessions(options, contents, map.path())) {
    std::cerr << "unimapper: session " << input.data.info.name << " ("
              << (input.data.info.sensor.empty() ? "unknown sensor" : input.data.info.sensor)
              << "): " << input.data.keyframes.size() << " keyframes\n";
    const bool is_first = std::find(runs.begin(), runs.end(), input.run) == runs.end();
    if (const auto stats = read_run_stats(input.run); stats && is_first) {
      for (const std::string& warning : stats->input_warnings) {
        std::cerr << "unimapper: warning: " << input.data.info.name << ": input, " << warning
                  << '\n';
      }
    }
    sessions.push_back(std::move(input.data));
    runs.push_back(std::move(input.run));
  }
  warn_of_cell_sizes(sessions, config.refinement.cell_size_m);
  // Before the merge, so that wrong session names are reported at once.
  const auto start = Clock::now();
  ReportInput report;
  report.references = gather_references(options.reference, sessions, runs);
  const merge::UserStatements statements = statements_of(options, sessions, runs);

  const auto merging = Clock::now();
  const linux_port::HostLoad load_before = linux_port::host_load();
  const merge::MergeResult result = merge::merge_sessions(
      sessions, config,
      [&](const std::string& text) {
        const std::string elapsed = fmt::format("{:6.1f} s", seconds_since(start));
        std::cerr << "unimapper: " << elapsed << "  " << text << std::endl;
      },
      statements, nullptr, map.path());
  report_positions(result, sessions);
  if (!output.crs.name.empty() && !(result.georeference && result.georeference->is_horizontal)) {
    std::cerr << "unimapper: warning: no position places the map in " << output.crs.name
              << ": its files have no coordinate system\n";
    output.crs = {};
  }
  warn_of_place(output, result);
  report.elapsed_s = seconds_since(merging);
  report.load = load_between(load_before, linux_port::host_load());
  report_grid(merge::export_map(map.path(), sessions, result, output));
  write_session_clouds(map.path(), sessions, result);
  if (scene) write_scene(scene->path(), scene_of_merge(sessions, result));

  if (options.refined_labels) {
    write_refined_labels_of_sessions(options, map.path(), sessions, result);
  }

  report.sessions = &sessions;
  report.result = &result;
  report.qualities = pair_qualities(sessions, result, report.references);
  write_pair_qualities(map.path() / "quality.json", sessions, report.qualities);
  if (!options.command_line.empty()) report.commands.push_back(options.command_line);
  MapFiles files = map_files(report.title, sessions, result, config.map.voxel_size_m);
  add_times(files, report);
  write_map_files(map.path() / kViewFolder, files);
  write_report(map.path() / "report.html", report, files);
  map.publish();
  if (scene) scene->publish();
  std::cout << summary_table(report);
  warn_of_walls_apart(sessions, report.qualities);
  warn_of_merged_sessions(sessions, result);
  if (const std::string drift = merge::drift_text(sessions, result); !drift.empty()) {
    std::cerr << "unimapper: warning: " << drift.substr(2) << '\n';  // behind "; "
  }
  const std::string waiting = waiting_text(sessions, result, "STORE");
  if (!waiting.empty()) {
    std::cerr << waiting << "unimapper: in a project: `unimapper map create`, `add` and `merge` "
              << "keep what people say\n";
  }
  std::cerr << "unimapper: map, trajectories and report are in " << options.out.string() << '\n';
  require_result(options, sessions, result);
}

}  // namespace unimapper::apps
