// Merges of a stored project, and exports of their results.
#include <fmt/format.h>
#include <malloc.h>

#include <chrono>
#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/store/project_writer.hpp"
#include "src/apps/export_options.hpp"
#include "src/apps/fleet/project_workers.hpp"
#include "src/apps/map/map_options.hpp"
#include "src/apps/map/project_merge.hpp"
#include "src/apps/map/stored_map.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/run_positions.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/replacement.hpp"
#include "src/apps/report.hpp"
#include "src/apps/report/times.hpp"
#include "src/apps/report/waiting_pairs.hpp"
#include "src/apps/scene/result_scene.hpp"
#include "src/apps/session_clouds.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {
namespace {

/// Stages and outcomes with the time since the start.
std::function<void(const std::string&)> progress() {
  const auto start = std::chrono::steady_clock::now();
  return [start](const std::string& text) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    const std::string seconds = fmt::format("{:6.1f} s", elapsed.count());
    std::cerr << "unimapper: " << seconds << "  " << text << std::endl;
  };
}

/// Large arrays go back to the system as they are freed. The allocator would keep them for smaller
/// ones, which then hold them in pieces.
void return_large_arrays() {
  constexpr int kLargeBytes = 4 << 20;
  mallopt(M_MMAP_THRESHOLD, kLargeBytes);
  mallopt(M_TRIM_THRESHOLD, kLargeBytes);
}

/// What is written, with the project's coordinate system, if the map is in it, or the one asked
/// for.
merge::ExportOptions options_of(const MapExportOptions& output, const StoredMap& map) {
  merge::ExportOptions options = output.output;
  const auto& place = map.posed.georeference;
  const bool is_placed = place && place->is_horizontal;
  if (!is_placed && !options.crs.name.empty()) {
    throw std::runtime_error("--crs: no known position of x and y places this map in " +
                             options.crs.name +
                             "; `unimapper map position` and `positions` take them, then `merge`");
  }
  if (!is_placed && !map.crs.empty()) {
    std::cerr << "unimapper: warning: no known position of x and y places the map in " << map.crs
              << ": its files have no coordinate system\n";
  }
  if (is_placed && !options.crs.name.empty() && !map.crs.empty() && options.crs.name != map.crs) {
    std::cerr << "unimapper: warning: --crs: the project's system is " << map.crs
              << "; coordinates stay as they are, only the name is another\n";
  }
  if (is_placed && options.crs.name.empty()) options.crs.name = map.crs;
  find_system(options);
  warn_of_place(options, map.posed);
  return options;
}

/// Null where none are asked for, or the server cannot be reached, which is said.
std::unique_ptr<ProjectWorkers> workers_of(const nats_port::Server& server,
                                           const std::filesystem::path& store,
                                           const merge::MergeConfig& config) {
  if (server.url.empty()) return nullptr;
  check(server);
  try {
    return std::make_unique<ProjectWorkers>(server, store, config);
  } catch (const nats_port::NatsError& error) {
    std::cerr << "unimapper: warning: " << error.what() << ": loops are verified here\n";
    return nullptr;
  }
}

}  // namespace

void merge_project(const ProjectOptions& options, const MapMergeOptions& merge_options) {
  return_large_arrays();
  merge::MergeConfig config;
  if (!merge_options.config.empty()) {
    parse_config(datasets::read_file(merge_options.config), merge_options.config.string(), config);
  }
  if (merge_options.threads) config.threads = *merge_options.threads;
  if (merge_options.memory_mb) config.memory_mb = *merge_options.memory_mb;
  store::ProjectWriter writer(options.store, "`unimapper map merge`");
  const store::ProjectState state = writer.current();
  if (state.sessions.empty()) {
    throw std::runtime_error("the project has no session; `unimapper map add` takes runs in");
  }
  const auto workers = workers_of(merge_options.workers, options.store, config);
  VerifyElsewhere elsewhere;
  if (workers) elsewhere = std::bind_front(&ProjectWorkers::verify, workers.get());
  const ProjectMerge merge =
      merge_stored(writer, options.store, state, config, progress(), {}, elsewhere);
  for (const SessionData& session : merge.sessions) {
    report_missing(options.store.string(), session);
  }
  std::cerr << "unimapper: " << merge.verified << '\n';
  if (workers) std::cerr << "unimapper: " << workers->text() << '\n';
  report_positions(merge.result, merge.sessions);
  warn_of_merged_sessions(merge.sessions, merge.result);
  std::cerr << waiting_text(merge.sessions, merge.result, options.store.string());
  const auto epoch = writer.commit("merge", [&](store::ProjectState& next) {
    next.epoch.result = writer.keep(merge.stored);
    return std::optional(merge.outcome);
  });
  std::cout << "epoch " << epoch->number << ": " << epoch->outcome << '\n';
}

void export_project(const ProjectOptions& options, const MapExportOptions& output) {
  return_large_arrays();
  check_output_folder(output.out, Output::kMap, output.replaces);
  if (!output.mcap.empty()) check_output_file(output.mcap, output.replaces);
  FolderReplacement folder(output.out, Output::kMap);
  std::optional<FileReplacement> scene;
  if (!output.mcap.empty()) scene.emplace(output.mcap);
  merge::MergeConfig limits;
  if (output.memory_mb) limits.memory_mb = *output.memory_mb;
  StoredContents contents(limits.kept_bytes());
  StoredMap map = read_stored_map(options.store, options.epoch, &contents);
  map.config.memory_mb = limits.memory_mb;
  const merge::ExportOptions output_options = options_of(output, map);
  const std::vector<SessionData>& sessions = map.sessions;
  ReportInput report;
  report.references = gather_references(output.reference, sessions,
                                        std::vector<std::filesystem::path>(sessions.size()));
  const linux_port::HostLoad load_before = linux_port::host_load();
  const merge::MergeResult result =
      merge::complete_merge(sessions, std::move(map.posed), map.config, progress(), folder.path());

  report_grid(merge::export_map(folder.path(), sessions, result, output_options));
  write_session_clouds(folder.path(), sessions, result);
  if (scene) write_scene(scene->path(), scene_of_merge(sessions, result));
  report.load = load_between(load_before, linux_port::host_load());
  report.sessions = &sessions;
  report.result = &result;
  report.qualities = pair_qualities(sessions, result, report.references);
  write_pair_qualities(folder.path() / "quality.json", sessions, report.qualities);
  MapFiles files = map_files(report.title, sessions, result, map.config.map.voxel_size_m);
  add_times(files, report);
  write_map_files(folder.path() / kViewFolder, files);
  write_report(folder.path() / "report.html", report, files);
  folder.publish();
  if (scene) scene->publish();
  if (!output.reference.truths.empty()) std::cout << summary_table(report);
  warn_of_walls_apart(sessions, report.qualities);
  warn_of_merged_sessions(sessions, result);
  std::cerr << "unimapper: the map of epoch " << map.epoch << " is in " << output.out.string()
            << '\n';
}

}  // namespace unimapper::apps
