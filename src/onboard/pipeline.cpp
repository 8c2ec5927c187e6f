#include "unimapper/onboard/pipeline.hpp"

#include <algorithm>
#include <cstdint>
#include <new>

#include "bayes_filter.hpp"
#include "budget.hpp"
#include "cell_table.hpp"
#include "coarse_voxels.hpp"
#include "component_classifier.hpp"
#include "event_reporter.hpp"
#include "evidence_window.hpp"
#include "final_labels.hpp"
#include "gravity.hpp"
#include "gravity_planes.hpp"
#include "ground.hpp"
#include "ground_aligner.hpp"
#include "ground_levels.hpp"
#include "keyframe_output.hpp"
#include "motion_gate.hpp"
#include "range_limit.hpp"
#include "sampling_monitor.hpp"
#include "scan_accumulator.hpp"
#include "stage_clock.hpp"
#include "transparent_ground.hpp"
#include "unimapper/core/angles.hpp"
#include "unimapper/free_space/range_image.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper {

using namespace onboard;

/// Everything the pipeline owns: one member per stage, in the order the data takes.
struct Pipeline::State {
  explicit State(const PipelineConfig& configuration) noexcept
      : config(configuration),
        gate(configuration.keyframe),
        budget(configuration),
        gravity(configuration.odometry),
        events(configuration) {}

  void allocate(Arena& arena) noexcept;

  ScanResult add_scan(const PointView& points, const Pose& pose, std::int64_t stamp_ns) noexcept;
  /// False if no point was valid; nothing has changed then.
  bool ingest(const PointView& points, const Pose& pose) noexcept;
  void begin_keyframe(const PointView& first_points, const Pose& first_pose) noexcept;
  [[nodiscard]] bool is_complete() const noexcept;
  void close_keyframe() noexcept;

  void remove_dynamic() noexcept;
  /// Leaves only as many candidates as there is time for; returns by how many to divide their cost.
  std::uint32_t shed_far_cells() noexcept;
  /// Where the keyframe that is closing was seen from.
  [[nodiscard]] Viewpoint viewpoint() const noexcept;
  /// Looks for up among what is static, and levels the keyframe's frame by it.
  void find_up() noexcept;
  /// Shows the images of the keyframe that was recorded last.
  void show_images() noexcept;
  void describe_place() noexcept;
  void search_loops() noexcept;
  void count_input(const ScanCounts& counts) noexcept;
  void count_result() noexcept;

  std::uint64_t& dropped(DropCause cause) noexcept {
    return statistics.dropped[static_cast<std::size_t>(cause)];
  }
  std::uint32_t& shed(Shed what) noexcept {
    return statistics.shed[static_cast<std::size_t>(what)];
  }

  PipelineConfig config;
  Pipeline pipeline;  ///< what the caller holds

  MotionGate gate;
  Budget budget;
  ScanAccumulator accumulator;
  RangePainter painter;
  SamplingMonitor sampling;
  GroundAligner aligner;
  CellTable cells;
  CoarseVoxels voxels;
  TransparentGround transparent;
  GroundLevels levels;
  EvidenceWindow window;
  BayesFilter filter;
  ComponentClassifier components;
  FinalLabels final_labels;
  GravityPlanes gravity_planes;
  GravityEstimator gravity;
  KeyframeOutput output;
  PlaceDescriber describer;
  PlaceDatabase places;
  EventReporter events;

  bool open = false;  ///< a keyframe has at least one scan and is not closed yet
  std::uint32_t scan_index = 0;
  std::uint32_t sequence = 0;
  KeyframeScan scans[KeyframeConfig::kMaxScans];
  FreeSpaceImage images[FreeSpaceConfig::kMaxImages];
  KeyframeStatistics statistics;
  KeyframeView view;
};

void Pipeline::State::allocate(Arena& arena) noexcept {
  accumulator.allocate(arena, config);
  painter.allocate(
      arena, {config.free_space.image_shape(), config.keyframe.range_min_m,
              config.keyframe.range_max_m, config.free_space.min_returns,
              config.keyframe.max_points_per_scan, SamplingMonitor::max_pixels(config.free_space)});
  sampling.allocate(arena, config);
  aligner.allocate(arena, config);
  cells.allocate(arena, config.voxel);
  voxels.allocate(arena, config.voxel);
  transparent.allocate(arena, config);
  levels.allocate(arena, config);
  window.allocate(arena, config);
  filter.allocate(arena, config);
  components.allocate(arena, config);
  final_labels.allocate(arena, config);
  gravity_planes.allocate(arena);
  output.allocate(arena, config);
  describer.allocate(arena, config.descriptor, config.descriptor_input());
  places.allocate(arena, config.loop_search, config.place_shape());
}

// ---------------------------------------------------------------------------------------------
// Scans to keyframes

ScanResult Pipeline::State::add_scan(const PointView& points, const Pose& pose,
                                     std::int64_t stamp_ns) noexcept {
  const StageTimer timer(config.clock_ns, statistics, Stage::kTotal);
  budget.start();
  const std::uint32_t index = scan_index++;

  const Motion motion = gate.check(pose, stamp_ns);
  if (motion.error.code != ErrorCode::kOk) {
    events.refusal(motion.error, stamp_ns, index);
    const bool closes = motion.error.code == ErrorCode::kPoseJump && open;
    if (closes) close_keyframe();
    return {motion.error, closes};
  }

  // Two poses in a row say that the robot is elsewhere: whatever was seen before is of no use.
  if (motion.restarted) {
    window.forget();
    final_labels.forget();
    gravity.forget();
    aligner.forget();
  }
  if (!open) begin_keyframe(points, pose);
  const Pose used = aligner.align(points, pose);
  if (!ingest(points, used)) {
    const Error empty{ErrorCode::kEmptyScan,
                      "the scan has no point that is finite and within the sensor's range"};
    events.refusal(empty, stamp_ns, index);
    return {empty, false};
  }
  scans[accumulator.scans() - 1] = {index, stamp_ns, used};
  statistics.aligned_scans += aligner.aligned() ? 1 : 0;
  gate.accept(pose, stamp_ns);
  sampling.add_pose(pose);
  open = true;

  if (!is_complete()) return {};
  close_keyframe();
  return {{}, true};
}

void Pipeline::State::begin_keyframe(const PointView& first_points,
                                     const Pose& first_pose) noexcept {
  const Grid grid = grid_near(first_pose.translation, config.voxel);
  statistics = {};
  if (sampling.look(first_points)) {
    painter.reshape(sampling.free_space().image_shape());
    window.follow(sampling.free_space());
    events.sampling_changed();
  }
  accumulator.begin(grid);
  window.begin(grid);
}

bool Pipeline::State::ingest(const PointView& points, const Pose& pose) noexcept {
  const StageTimer timer(config.clock_ns, statistics, Stage::kIngest);
  const ScanCounts counts = accumulator.add(points, pose, window.blocks());
  if (counts.valid == 0) return false;
  count_input(counts);
  if (config.free_space.visibility) {
    RangeImage* const image = window.image_for(accumulator.scans() - 1, pose);
    if (image != nullptr) painter.paint(points, image->pixels);
  }
  return true;
}

bool Pipeline::State::is_complete() const noexcept {
  const std::uint32_t count = accumulator.scans();
  if (count >= config.keyframe.scans) return true;
  const Eigen::Vector3d travelled =
      scans[count - 1].T_odometry_sensor.translation - scans[0].T_odometry_sensor.translation;
  const auto distance_m = static_cast<double>(config.keyframe.distance_m);
  return distance_m > 0.0 && travelled.squaredNorm() >= distance_m * distance_m;
}

void Pipeline::State::close_keyframe() noexcept {
  open = false;
  view = {};
  view.sequence = sequence++;
  view.scans = {scans, accumulator.scans()};
  view.reference_scan = accumulator.scans() / 2;
  view.T_odometry_keyframe = level_frame(scans[view.reference_scan].T_odometry_sensor);
  view.statistics = &statistics;
  statistics.attitude_noise_deg = aligner.noise_deg();
  statistics.sweep_tilt_deg = aligner.sweep_tilt_deg();
  if (sampling.close()) events.sampling_changed();
  statistics.sampling = sampling.statistics();

  remove_dynamic();
  describe_place();
  search_loops();
  budget.measure(Budget::Part::kCounting, 1, [this] { count_result(); });
  statistics.deadline_missed = budget.is_exceeded();
  events.keyframe(view, budget.spent_us());
}

// ---------------------------------------------------------------------------------------------
// The paper's overview figure, one call per arrow

void Pipeline::State::remove_dynamic() noexcept {
  const StageTimer timer(config.clock_ns, statistics, Stage::kRemoval);
  window.blocks().arrange(accumulator.cells().blocks());
  cells.build(accumulator.cells(), window.blocks().order(), accumulator.grid());
  voxels.build(cells);
  statistics.ground_voxels =
      find_ground(config.ground, config.voxel.coarse_size_m, viewpoint().sensor_m, voxels.map());
  statistics.ground_voxels -= transparent.reject(window, cells, voxels);
  statistics.ground_voxels -= levels.reject_elevated(voxels.map());
  propagate_ground(config.ground, voxels.map());
  split_ground(config.ground, config.removal, voxels, cells);
  // The paper's columns alone count every occupied cell.
  if (config.free_space.visibility) window.leave_out_ground(cells);
  if (config.free_space.columns) {
    window.current().columns.build(
        cells.blocks(), [this](std::uint32_t b) noexcept { return cells.marks(b).ground; });
  }
  const std::uint32_t candidates = shed_far_cells();
  budget.measure(Budget::Part::kFiltering, candidates, [this] { filter.run(window, cells); });
  budget.measure(Budget::Part::kClassifying, 1, [this] {
    if (config.removal.components) {
      statistics.components =
          components.run(window.blocks(), filter.log_odds(), viewpoint(), cells);
    }
    final_labels.relabel_evicted(window);
    view.relabelled = final_labels.result();
    final_labels.store(window.blocks(), cells, view.sequence);
    dropped(DropCause::kEvidenceFull) = window.left_out() + final_labels.left_out();
    window.record(cells);
    show_images();
    find_up();
    output.build(cells, voxels, view.T_odometry_keyframe);
  });
  view.static_cells = output.static_cells();
  view.dynamic_cells = output.dynamic_cells();
}

Viewpoint Pipeline::State::viewpoint() const noexcept {
  const Eigen::Vector3d& sensor = scans[view.reference_scan].T_odometry_sensor.translation;
  return {(sensor - cells.grid().origin_m()).cast<float>(), sampling.free_space().ray_spacing_deg};
}

void Pipeline::State::find_up() noexcept {
  const GravityScene scene = gravity_planes.collect(cells, voxels);
  const UpEstimate& estimate = gravity.add(scene);
  statistics.walls = static_cast<std::uint32_t>(scene.walls.size());
  statistics.up_known = estimate.known;
  statistics.up_contradicted = estimate.contradicted;
  if (!estimate.known) return;
  Pose& frame = view.T_odometry_keyframe;
  frame = level_frame(scans[view.reference_scan].T_odometry_sensor, estimate.up);
  const Eigen::Matrix3d covariance =
      frame.rotation.transpose() * estimate.covariance * frame.rotation;
  view.up = {true, static_cast<float>(covariance(0, 0)), static_cast<float>(covariance(0, 1)),
             static_cast<float>(covariance(1, 1))};
  const auto level = static_cast<float>(estimate.up.head<2>().norm());
  statistics.odometry_tilt_deg =
      360.0F * direction_turns(static_cast<float>(estimate.up.z()), level);
}

void Pipeline::State::show_images() noexcept {
  const KeyframeEvidence& recorded = window.earlier(1);
  const std::span<const RangeImage> painted = recorded.painted();
  const std::size_t pixels = recorded.projection.pixels();
  for (std::size_t i = 0; i < painted.size(); ++i) {
    images[i] = {painted[i].scan, {painted[i].pixels, pixels}};
  }
  view.image_shape = recorded.shape;
  view.image_full_weight_range_m = recorded.full_weight_range_m;
  view.images = {images, painted.size()};
}

std::uint32_t Pipeline::State::shed_far_cells() noexcept {
  if (!budget.is_on()) return 0;
  const Eigen::Vector3f sensor =
      (view.T_odometry_keyframe.translation - cells.grid().origin_m()).cast<float>();
  const RangeLimit limit =
      keep_nearest(cells, sensor, config.keyframe.range_max_m, budget.affordable_cells());
  shed(Shed::kFarCells) = limit.shed;
  statistics.removal_range_m = limit.range_m;
  // What does not depend on the number of cells must not look like the cost of a few.
  constexpr std::uint32_t kFewest = 1024;
  return std::max(limit.kept, kFewest);
}

void Pipeline::State::describe_place() noexcept {
  const StageTimer timer(config.clock_ns, statistics, Stage::kDescription);
  // In the order of `Shed`: far cells are skipped only after the description.
  if (shed(Shed::kFarCells) != 0 || !budget.affords(Budget::Part::kDescribing)) {
    shed(Shed::kDescription) = 1;
    return;
  }
  budget.measure(Budget::Part::kDescribing, 1,
                 [this] { view.place = describer.describe(view.static_cells); });
  view.place.up = view.up;
  dropped(DropCause::kDescriptionFull) = describer.dropped();
}

void Pipeline::State::search_loops() noexcept {
  const StageTimer timer(config.clock_ns, statistics, Stage::kSearch);
  const KeyframeId id{0, view.sequence};
  const std::uint64_t dropped_before = places.dropped();
  // Without a description there is nothing to look for and nothing to store.
  const bool described = shed(Shed::kDescription) == 0;
  const bool searches = described && budget.affords(Budget::Part::kSearching);
  const bool inserts = searches || (described && budget.affords(Budget::Part::kInserting));
  shed(Shed::kSearch) = searches ? 0 : 1;
  shed(Shed::kInsertion) = inserts ? 0 : 1;
  if (searches) {
    budget.measure(Budget::Part::kSearching, 1,
                   [&] { view.loops = places.search(view.place, id, config.search_scope); });
  }
  if (inserts) {
    budget.measure(Budget::Part::kInserting, 1,
                   [&] { places.insert(view.place, id, view.T_odometry_keyframe); });
  }
  dropped(DropCause::kTriangleTableFull) = places.dropped() - dropped_before;
}

// ---------------------------------------------------------------------------------------------
// Bookkeeping

void Pipeline::State::count_input(const ScanCounts& counts) noexcept {
  statistics.points_in += counts.points;
  statistics.points_valid += counts.valid;
  dropped(DropCause::kNotFinite) += counts.not_finite;
  dropped(DropCause::kOutOfRange) += counts.out_of_range;
  dropped(DropCause::kScanTooLarge) += counts.beyond_capacity;
  dropped(DropCause::kCellsFull) += counts.no_cell;
}

void Pipeline::State::count_result() noexcept {
  const std::uint64_t invalid =
      statistics.dropped_by(DropCause::kNotFinite) + statistics.dropped_by(DropCause::kOutOfRange);
  statistics.points_dynamic = output.count_dynamic(accumulator);
  view.points_in = statistics.points_in;
  view.points_dynamic = statistics.points_dynamic;
  statistics.points_static = statistics.points_in - invalid - statistics.points_dynamic;
  statistics.cells = accumulator.cells().size();
  statistics.dynamic_cells = static_cast<std::uint32_t>(view.dynamic_cells.size());
  statistics.voxels = voxels.map().size();
  dropped(DropCause::kVoxelsFull) = voxels.left_out();

  const auto use = [this](Capacity which, std::uint64_t used, std::uint64_t capacity) {
    statistics.capacity[static_cast<std::size_t>(which)] = {used, capacity};
  };
  use(Capacity::kPointsPerScan, accumulator.largest_scan(), config.keyframe.max_points_per_scan);
  use(Capacity::kCells, statistics.cells, config.voxel.max_cells);
  use(Capacity::kVoxels, statistics.voxels, config.voxel.max_voxels);
  use(Capacity::kBlocks, window.blocks().size(), window.blocks().capacity());
  use(Capacity::kPlaces, places.size(), config.loop_search.max_places);
}

// ---------------------------------------------------------------------------------------------
// What the caller sees

std::size_t Pipeline::required_bytes(const PipelineConfig& config) noexcept {
  if (config.validate().code != ErrorCode::kOk) return 0;
  Arena arena = Arena::measuring();
  arena.allocate<std::byte>(sizeof(State));
  State state(config);
  state.allocate(arena);
  return arena.used();
}

Expected<Pipeline*> Pipeline::create(const PipelineConfig& config,
                                     std::span<std::byte> memory) noexcept {
  const Error invalid = config.validate();
  if (invalid.code != ErrorCode::kOk) return invalid;
  if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
    return Error{ErrorCode::kMemoryMisaligned, "the memory must start on a 64-byte boundary"};
  }
  if (memory.size() < required_bytes(config)) {
    return Error{ErrorCode::kMemoryTooSmall,
                 "the memory is smaller than Pipeline::required_bytes(config)"};
  }
  Arena arena(memory.data(), memory.size());
  State* state = new (arena.allocate<std::byte>(sizeof(State))) State(config);
  state->allocate(arena);
  state->pipeline.state_ = state;
  return &state->pipeline;
}

ScanResult Pipeline::add_scan(const PointView& points, const Pose& T_odometry_sensor,
                              std::int64_t stamp_ns) noexcept {
  return state_->add_scan(points, T_odometry_sensor, stamp_ns);
}

ScanResult Pipeline::flush() noexcept {
  if (!state_->open) return {};
  const StageTimer timer(state_->config.clock_ns, state_->statistics, Stage::kTotal);
  state_->budget.start();
  state_->close_keyframe();
  return {{}, true};
}

const KeyframeView& Pipeline::keyframe() const noexcept { return state_->view; }

std::size_t Pipeline::labels(std::size_t scan_in_keyframe,
                             std::span<PointLabel> out) const noexcept {
  if (scan_in_keyframe >= state_->accumulator.scans()) return 0;
  const auto scan = static_cast<std::uint32_t>(scan_in_keyframe);
  const std::span<const PointCode> codes = state_->accumulator.codes(scan);
  const std::size_t count = std::min(out.size(), state_->accumulator.points_of(scan));
  const std::size_t coded = std::min(count, codes.size());
  for (std::size_t i = 0; i < coded; ++i) out[i] = state_->output.label(codes[i]);
  // What did not fit the scan's capacity was never looked at.
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(coded),
            out.begin() + static_cast<std::ptrdiff_t>(count), PointLabel::kStatic);
  return count;
}

std::size_t Pipeline::relabel(const PointView& points, const Pose& T_odometry_sensor,
                              std::span<PointLabel> labels) const noexcept {
  return state_->final_labels.relabel(points, state_->aligner.used_pose(T_odometry_sensor), labels);
}

bool Pipeline::relabel_next() noexcept {
  const bool relabelled = !state_->open && state_->final_labels.relabel_oldest(state_->window);
  state_->view.relabelled = state_->final_labels.result();
  return relabelled;
}

PlaceDatabase& Pipeline::places() noexcept { return state_->places; }

const PipelineConfig& Pipeline::config() const noexcept { return state_->config; }

}  // namespace unimapper
