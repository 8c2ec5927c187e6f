// `unimapper onboard`: replay of a recording into a run folder.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "ports/keys/key_files.hpp"
#include "ports/keys/signature.hpp"
#include "ports/linux/boot_id.hpp"
#include "ports/linux/executor.hpp"
#include "src/apps/map/position_file.hpp"
#include "src/apps/onboard/delivery.hpp"
#include "src/apps/onboard/event_log.hpp"
#include "src/apps/onboard/input_check.hpp"
#include "src/apps/onboard/replay.hpp"
#include "src/apps/onboard/session_range.hpp"
#include "src/apps/onboard/setup.hpp"
#include "src/apps/onboard/share.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/print.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/core/voxel_key.hpp"
#include "src/input/text.hpp"
#include "src/merge/export/loops_csv.hpp"
#include "src/wire/keyframe_limits.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

namespace {

/// A number that depends on text and seed alone, on every machine and in every release.
std::uint64_t stable_hash(std::string_view text, std::uint64_t seed = 0) {
  std::uint64_t hash = mix_bits(seed + text.size());
  for (const char c : text) hash = mix_bits(hash ^ static_cast<std::uint8_t>(c));
  return hash;
}

/// In files, numbers that differ between sessions but not between two runs on the same recording.
/// On a network every start is a session of its own, whatever the robot is called and the clock
/// says.
/// With a key the robot's number is the key's.
SessionId session_id(const std::string& name, std::int64_t first_stamp_ns, bool published,
                     const keys::RobotKey* key) {
  const std::uint64_t robot = key != nullptr ? key->robot : stable_hash(name);
  const std::uint64_t low = stable_hash(name, static_cast<std::uint64_t>(first_stamp_ns));
  const BootId boot = published ? linux_port::random_boot() : BootId(stable_hash(name, low), low);
  return {static_cast<std::uint32_t>(robot), boot};
}

/// Throws where the pipeline was refused, with the reason.
void require(const OwnedPipeline& pipeline) {
  if (pipeline.ok()) return;
  std::string reason = pipeline.error().message;
  if (pipeline.bytes() > 0) reason += ", " + std::to_string(pipeline.bytes() >> 20U) + " MiB";
  throw std::runtime_error(reason);
}

/// Earlier places are inserted first and would be forgotten first, so the capacity must hold all.
void enlarge_capacity_for(const std::vector<EarlierSession>& earlier, std::size_t scans,
                          PipelineConfig& config) {
  if (earlier.empty()) return;
  std::size_t places = scans;  // a keyframe has at least one scan
  for (const EarlierSession& session : earlier) places += session.keyframes.size();
  constexpr std::size_t kMostPlaces = 65534;
  const auto needed = static_cast<std::uint32_t>(std::min(places, kMostPlaces));
  config.loop_search.max_places = std::max(config.loop_search.max_places, needed);
}

std::string describe_run(const OnboardOptions& options, const RunFolder& folder,
                         const SessionId& id, const SensorModel& sensor,
                         const PipelineConfig& config, const datasets::Dataset& recording) {
  const std::string hash = fmt::format("{:016x}", stable_hash(dump_config(config)));
  fs::path dataset = fs::absolute(options.dataset).lexically_normal();
  if (dataset.filename().empty()) dataset = dataset.parent_path();
  nlohmann::ordered_json json;
  json["session"] = folder.session_name();
  json["robot_id"] = id.robot;
  json["boot"] = wire::to_text(id.boot);
  json["sensor"] = sensor.name;
  json["dataset"] = dataset.filename().string();
  json["preset"] = options.preset;
  json["config_hash"] = hash;
  json["unimapper_version"] = UNIMAPPER_VERSION;
  json["keyframe_schema"] = wire::kKeyframeSchema;
  if (config.intensity) {
    json["intensity_range"] = datasets::IntensityScale(recording).range();
  }
  return json.dump(2) + "\n";
}

std::optional<keys::RobotKey> read_key(const OnboardOptions& options) {
  if (options.key.empty()) return std::nullopt;
  return keys::read_robot_key(options.key);
}

void print_summary(const RunStatistics& statistics, std::uint64_t allocations) {
  const StageTimes total = statistics.stage_times(Stage::kTotal);
  print_to(stderr,
           "onboard: {} scans, {} refused, {} keyframes, {:.2f} % of the points dynamic, {} "
           "loops\nonboard: a keyframe takes {:.1f} ms (median), {:.1f} ms (99 %), {:.1f} ms "
           "(longest); {} deadlines missed, {} allocations\n",
           statistics.scans(), statistics.scans_refused(), statistics.keyframes(),
           100.0 * statistics.dynamic_share(), statistics.loops_accepted(), total.p50_ms,
           total.p99_ms, total.max_ms, statistics.deadline_misses(), allocations);
  if (statistics.keyframes_repeated() == 0) return;
  print_to(stderr,
           "onboard: {} more keyframes repeat others while the robot stands: labelled, not kept\n",
           statistics.keyframes_repeated());
}

void print_up(const RunStatistics& statistics, const PipelineConfig& config) {
  print_to(stderr, "onboard: up known in {} of {} keyframes", statistics.keyframes_up_known(),
           statistics.keyframes());
  if (statistics.keyframes_up_known() > 0) {
    print_to(stderr, ", the odometry's z axis {:.1f} degrees from it (median)",
             statistics.odometry_tilt_deg());
  }
  print_to(stderr, "\n");
  const std::uint64_t unknown = statistics.keyframes() - statistics.keyframes_up_known();
  if (unknown > 0) {
    print_to(
        stderr,
        "onboard: warning: up is unknown in {} keyframes{}; loops take their z axis to be up "
        "within {:.1f} deg\n",
        unknown,
        config.odometry.up_sigma_deg > 0.0F ? "" : ", and odometry.up_sigma_deg promises nothing",
        kUnknownUpSigmaDeg);
  }
  if (statistics.keyframes_up_contradicted() == 0) return;
  print_to(stderr,
           "onboard: warning: in {} keyframes up is not where odometry.up_sigma_deg says, by "
           "three sigma\n",
           statistics.keyframes_up_contradicted());
}

/// One sentence each for what the scans say of sensor and poses that was not as configured.
void warn_of_input(const RunStatistics& statistics, const FreeSpaceConfig& assumed) {
  const SamplingStatistics& found = statistics.sampling();
  if (found.rays_differ) {
    print_to(stderr,
             "onboard: warning: rays are {:.2f} deg apart on a ring and rings {:.2f} deg, not "
             "{:.2f} and {:.2f} as the sensor's data sheet says; the measured values were used\n",
             found.ray_spacing_deg, found.ring_spacing_deg, assumed.ray_spacing_deg,
             assumed.ring_spacing_deg);
  }
  if (found.elevations_differ) {
    print_to(
        stderr,
        "onboard: warning: rays leave the sensor's field of view of {:.1f} to {:.1f} deg "
        "(points in a pitched frame, or the LiDAR upside down?); {:.1f} to {:.1f} deg was used\n",
        assumed.elevation_min_deg, assumed.elevation_max_deg, found.image_elevation_min_deg,
        found.image_elevation_max_deg);
  }
  if (found.changes > 0) {
    print_to(stderr, "onboard: warning: the sensor changed its mode {} times\n", found.changes);
  }
  if (statistics.keyframes_odometry_contradicted() > 0) {
    print_to(stderr,
             "onboard: warning: scans contradict the odometry in {} keyframes (events.log): it "
             "jumped, started anew, or did not feel a lift\n",
             statistics.keyframes_odometry_contradicted());
  }
  if (statistics.sweep_tilt_deg() > 0.0F) {
    print_to(stderr,
             "onboard: warning: sweeps look uncompensated: scans tilt with the sensor's own "
             "rotation, by {:.2f} deg; {} scans were aligned to the ground\n",
             statistics.sweep_tilt_deg(), statistics.aligned_scans());
  } else if (statistics.aligned_scans() > 0) {
    print_to(stderr,
             "onboard: warning: roll and pitch of the poses scatter by {:.2f} deg from scan to "
             "scan: a noisy odometry, poses far apart in time, or of other axes or handedness than "
             "the points; {} scans were aligned to the ground\n",
             statistics.attitude_noise_deg(), statistics.aligned_scans());
  }
}

/// Labels that later keyframes changed: the online ones rest on little evidence.
void warn_of_labels(const RunStatistics& statistics) {
  // Measured: no more in drives with AA of 97 % and more but for two of fifteen.
  constexpr double kMany = 0.15;
  if (statistics.relabelled_share() < kMany) return;
  print_to(stderr,
           "onboard: warning: later keyframes changed the label of {:.0f} % of the cells that "
           "move: prefer those of --final-labels, or of `unimapper merge --refined-labels`\n",
           100.0 * statistics.relabelled_share());
}

/// What a full container left out, in words, and which parameter makes room.
struct FullContainer {
  DropCause cause;
  /// A description has a fixed size: that it holds a sample is no fault, but it is said.
  const char* severity;
  const char* what;
  const char* remedy;
};

constexpr std::array<FullContainer, 5> kFullContainers = {{
    {DropCause::kScanTooLarge, "warning", "points labelled static unseen",
     "raise keyframe.max_points_per_scan (--config), or name the --sensor"},
    {DropCause::kCellsFull, "warning", "points labelled static unseen",
     "lower keyframe.range_max_m or raise voxel.max_cells (--config), or a larger --preset"},
    {DropCause::kVoxelsFull, "warning", "fine cells without a ground or plane around them",
     "raise voxel.max_voxels (--config)"},
    {DropCause::kEvidenceFull, "warning", "columns and blocks of evidence not kept",
     "their cells keep the online labels; raise voxel.max_cells (--config) for final labels"},
    {DropCause::kDescriptionFull, "note", "candidates for keypoints and planes not described",
     "a sample was described; raise voxel.max_cells, descriptor.max_voxels or "
     "descriptor.max_planes (--config) only if loops are missed"},
}};

void warn_of_full_containers(const RunStatistics& statistics) {
  for (const FullContainer& full : kFullContainers) {
    const std::uint64_t count = statistics.dropped(full.cause);
    if (count == 0) continue;
    const std::uint64_t keyframes = statistics.keyframes_dropping(full.cause);
    print_to(stderr,
             "onboard: {}: container full ({}) in {} of {} keyframes ({:.0f} %): {} {}, {} a "
             "keyframe; {}\n",
             full.severity, drop_cause_name(full.cause), keyframes, statistics.keyframes(),
             100.0 * static_cast<double>(keyframes) /
                 static_cast<double>(std::max<std::uint64_t>(statistics.keyframes(), 1)),
             count, full.what, count / std::max<std::uint64_t>(keyframes, 1), full.remedy);
  }
}

/// Why refused scans may have been refused, for the cause that is most frequent.
std::string remedy_for_refusals(const RunStatistics& statistics) {
  const std::string cause = statistics.most_frequent_refusal();
  if (cause == refusal_name(ErrorCode::kEmptyScan)) {
    return "no point within range: are the points in metres, and is it the right --sensor?";
  }
  if (cause == refusal_name(ErrorCode::kPoseJump)) {
    return "the poses jump: do they belong to these scans, in metres, in this order?";
  }
  if (cause == refusal_name(ErrorCode::kTimeReversed)) {
    return "the stamps do not increase: are they in one unit, one a scan?";
  }
  if (cause == refusal_name(ErrorCode::kTimeJump)) {
    return "the stamps lie minutes apart: are they in one unit, one a scan?";
  }
  return "stats.json counts the causes";
}

/// Throws where the run has nothing to merge: exit code 0 would pass for a result.
void require_result(const RunStatistics& statistics) {
  if (statistics.scans() > 0 && statistics.scans_refused() == statistics.scans()) {
    throw std::runtime_error("all " + std::to_string(statistics.scans()) +
                             " scans were refused: " + remedy_for_refusals(statistics));
  }
  if (statistics.keyframes() == 0) throw std::runtime_error("no keyframe came of this recording");
  if (statistics.points_static() == 0) {
    throw std::runtime_error("no static point came of this recording: its map would be empty");
  }
}

/// Throws where the run folder lacks something: exit code 0 would pass for all of it.
void require_whole(const fs::path& out, const WriteFailures& failures) {
  if (failures.count() == 0) return;
  throw std::runtime_error(std::to_string(failures.count()) +
                           " files could not be written: " + out.string() + " is incomplete");
}

/// Says before the first scan that the sensor may see more than there is room for.
void note_sensor_fit(const SensorModel& sensor, const PipelineConfig& config, Progress& progress) {
  const SensorFit fit = sensor_fit(sensor, config);
  if (fit.fits()) return;
  const std::string text = fmt::format(
      "warning: sensor and preset do not fit: in a dense street {} may occupy {} fine cells within "
      "{:.0f} m, there is room for {}; points that find none stay static unseen. Set "
      "keyframe.range_max_m to {:.0f} or voxel.max_cells to {} (--config), or choose a larger "
      "--preset",
      sensor.name, fit.cells_needed, config.keyframe.range_max_m, fit.cells,
      std::floor(static_cast<double>(fit.range_m)), fit.cells_needed);
  progress.note(text);
}

/// What a note says, whatever it has counted.
std::string without_digits(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

void print_note(const datasets::Note& note, Progress& progress) {
  progress.note((note.is_warning ? "warning: " : "") + note.text);
}

/// How many scans no session has: their odometry is wrong. All points count as static.
std::size_t write_labels_of_rest(const datasets::Dataset& dataset,
                                 const std::vector<SessionRange>& ranges, std::size_t scans,
                                 bool final_labels, RunFolder& folder) {
  datasets::Scan scan;
  std::size_t next = 0;
  std::size_t count = 0;
  const auto leave_out = [&](std::size_t end) {
    for (; next < end; ++next, ++count) {
      dataset.read_scan(next, scan);
      folder.write_labels(dataset.scan_name(next), {}, scan.points.size());
      if (final_labels) {
        folder.write_final_labels(dataset.scan_name(next), {}, scan.points.size());
      }
    }
  };
  for (const SessionRange& range : ranges) {
    leave_out(range.first);
    next = range.end;
  }
  leave_out(scans);
  return count;
}

}  // namespace

void run_onboard(const OnboardOptions& options) {
  const std::optional<keys::RobotKey> key = read_key(options);
  check_output_folder(options.out, Output::kRun, options.replaces);
  check_outside_recording(options.out, options.dataset);
  const OpenedInput opened = open_input(options);
  const auto& dataset = opened.dataset;
  CheckedInput checked = check_input(options, opened);
  const ChosenSensor sensor = choose_sensor(options, dataset->sensor(), checked.sensor);
  std::vector<input::Finding> findings = std::move(checked.findings);
  for (const input::Finding& finding : sensor.findings) {
    if (finding.severity != input::Severity::kFine) print_warning(finding);
    findings.push_back(finding);
  }
  const FirstScans first = look_at_first_scans(options, *dataset, sensor.model, checked.sensor);
  PipelineConfig config = make_config(options, sensor.model, first);
  const std::size_t scans = std::min(options.scans, dataset->scan_count());

  std::vector<std::string> faults;
  const auto earlier = read_earlier_runs(options.against, faults);
  enlarge_capacity_for(earlier, scans, config);
  RunFolder folder(options.out);
  EventLog events(folder.event_log(), options.realtime);
  config.events = events.ring();
  linux_port::WorkerThreads threads(options.workers);
  config.executor = threads.executor();
  const std::vector<SessionRange> ranges =
      session_ranges(checked.breaks, scans, (config.keyframe.scans + 1) / 2);
  const auto info_of = [&](std::size_t index) -> SessionInfo {
    const std::string name = range_name(folder.session_name(), index);
    return {session_id(name, dataset->stamp_ns(ranges[index].first),
                       !options.publish.empty() || !options.spool.empty(), key ? &*key : nullptr),
            name, std::string(sensor.model.name)};
  };
  SessionInfo info = info_of(0);
  const std::string description =
      describe_run(options, folder, info.id, sensor.model, config, *dataset);
  Progress progress("onboard", scans);
  progress.note("sensor " + info.sensor + " (" + sensor.source + ")");
  progress.note("surroundings " + std::string(surroundings_name(first.surroundings)) + " (" +
                first.source + ")");
  if (first.columns > 0) {
    progress.note("room for a mode of " + std::to_string(first.columns) + " columns");
  }
  if (first.copies > kNotedCopies) {
    progress.note(
        input::text("points are there %.2f times on average, exact copies counted: both "
                    "returns of a ray that are one? The sensor's rays are measured "
                    "without copies",
                    first.copies));
  }
  if (first.surroundings == Surroundings::kOutdoors) {
    SensorModel mode = sensor.model;
    if (first.columns > 0) mode.points_per_scan = first.columns * mode.rings;
    note_sensor_fit(mode, config, progress);
  }
  const std::vector<datasets::Note> notes_before = dataset->notes();
  for (const datasets::Note& note : notes_before) print_note(note, progress);
  for (const std::string& fault : faults) progress.note("warning: " + fault);
  if (!threads.outcome().ok) {
    progress.note(fmt::format("warning: one worker instead of {}: {}", options.workers,
                              threads.outcome().message));
  }

  RunStatistics statistics;
  lcm_port::SessionLogWriter log(folder.keyframe_log(), info);
  const auto signer = key ? std::make_optional<keys::KeyframeSigner>(*key) : std::nullopt;
  RunStatistics::Run run;
  run.realtime = options.realtime;
  run.workers = config.executor.workers;
  run.surroundings = surroundings_name(first.surroundings);
  run.extent_m = first.extent_m;
  std::vector<LoopRecord> loops;
  std::vector<std::size_t> repeated;
  const linux_port::HostLoad load_before = linux_port::host_load();
  for (std::size_t index = 0; index < ranges.size(); ++index) {
    // No evidence and no loop of the robot's reaches beyond a break of the odometry.
    OwnedPipeline pipeline(config);
    require(pipeline);
    if (index > 0) {
      info = info_of(index);
      folder.failures().attempt([&log, &info] { log.begin(info); });
    }
    KnownKeyframes known(info.name, earlier);
    known.insert_into(pipeline->places());
    Delivery delivery(options, info, key ? &*key : nullptr);
    config = pipeline->config();
    const auto share = open_share(options, config, info.id);
    // Only now it is a run: what is refused before leaves nothing that must be replaced.
    if (index == 0) folder.write_text("run.json", description);
    Replay replay(*dataset, *pipeline,
                  {.session = info.id,
                   .first = ranges[index].first,
                   .end = ranges[index].end,
                   .realtime = options.realtime,
                   .all_candidates = options.all_candidates,
                   .final_labels = options.final_labels},
                  {.folder = folder,
                   .statistics = statistics,
                   .known = known,
                   .log = log,
                   .delivery = delivery,
                   .signer = signer ? &*signer : nullptr,
                   .share = share != nullptr ? share->get() : nullptr,
                   .progress = progress});
    replay.run();
    folder.failures().attempt([&log] { log.finish(); });
    loops.insert(loops.end(), replay.loops().begin(), replay.loops().end());
    repeated.insert(repeated.end(), replay.repeated().begin(), replay.repeated().end());
    run.allocations_after_start += replay.allocations();
    run.arena_bytes = pipeline.bytes();
    run.sessions.push_back(info.name);
    run.delivery = delivery.finish();
    print_delivery(run.delivery, statistics.keyframes(), options);
    if (share != nullptr && share->get()->health().not_shared > 0) {
      print_to(stderr, "onboard: warning: {} messages did not fit into shared memory\n",
               share->get()->health().not_shared);
    }
  }
  run.load = load_between(load_before, linux_port::host_load());
  run.scans_left_out = write_labels_of_rest(*dataset, ranges, scans, options.final_labels, folder);
  if (run.scans_left_out > 0) {
    print_to(stderr,
             "onboard: warning: {} scans between breaks are left out: too few for a session, or "
             "no pose is right\n",
             run.scans_left_out);
  }

  folder.failures().attempt([&events] { events.finish(); });
  folder.write_text("loops.csv", merge::format_loops_csv(loops));
  const std::vector<datasets::Fix> fixes = dataset->fixes();
  if (!fixes.empty()) folder.write_text(kPositionsFile, format_positions(fixes));
  if (const auto found = check_repeated_clouds(*dataset, repeated, scans)) {
    print_warning(*found);
    findings.push_back(*found);
  }
  if (const auto found = check_dynamic_share(statistics.dynamic_share(), statistics.scans())) {
    print_warning(*found);
    findings.push_back(*found);
  }
  for (const datasets::Note& note : dataset->notes()) {
    // What showed only while all scans were read; what was counted on is in stats.json.
    const bool is_said =
        std::any_of(notes_before.begin(), notes_before.end(), [&](const auto& said) {
          return said.is_warning == note.is_warning &&
                 without_digits(said.text) == without_digits(note.text);
        });
    if (!is_said) print_note(note, progress);
    const auto severity = note.is_warning ? input::Severity::kSuspicious : input::Severity::kFine;
    findings.push_back({"reader", severity, 0.0, {}, note.text});
  }
  run.files_not_written = folder.failures().count();
  run.input = std::move(findings);
  folder.write_text("stats.json", statistics.to_json(run));
  print_summary(statistics, run.allocations_after_start);
  for (const input::Finding& finding : run.input) {
    if (finding.check == kForced) print_warning(finding);
  }
  print_up(statistics, config);
  warn_of_full_containers(statistics);
  warn_of_input(statistics, config.free_space);
  warn_of_labels(statistics);
  require_result(statistics);
  require_whole(options.out, folder.failures());
  if (!fixes.empty()) {
    print_to(stderr,
             "onboard: positions of satellites are in {}/{}; `unimapper merge --crs NAME` places "
             "the map by them\n",
             options.out.c_str(), kPositionsFile);
  }
  print_to(stderr, "onboard: the run is in {}; next: unimapper merge {} --out map\n",
           options.out.c_str(), options.out.c_str());
}

}  // namespace unimapper::apps
