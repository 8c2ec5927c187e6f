#include "src/apps/onboard/run_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "src/apps/map_pose_text.hpp"
#include "src/apps/onboard/input_check.hpp"
#include "src/core/quantile.hpp"

namespace unimapper::apps {

using Json = nlohmann::ordered_json;

std::string refusal_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidPose:
      return "invalid_pose";
    case ErrorCode::kTimeReversed:
      return "time_reversed";
    case ErrorCode::kEmptyScan:
      return "empty_scan";
    case ErrorCode::kPoseJump:
      return "pose_jump";
    case ErrorCode::kCapacityExceeded:
      return "capacity_exceeded";
    case ErrorCode::kTimeJump:
      return "time_jump";
    default:
      return "other";
  }
}

void RunStatistics::add_encoding(const lcm_port::EncodingCounters& counters) {
  encoding_.handed_over += counters.handed_over;
  encoding_.encoded += counters.encoded;
  encoding_.dropped += counters.dropped;
  encoding_.refused += counters.refused;
  encoding_.bytes += counters.bytes;
  encoding_.image_bytes += counters.image_bytes;
  encoding_.left_out += counters.left_out;
}

void RunStatistics::add_scan(std::size_t points, const Error& error) {
  ++scans_;
  points_in_ += points;
  if (error.code != ErrorCode::kOk) ++refused_[refusal_name(error.code)];
}

void RunStatistics::count(const KeyframeStatistics& statistics) {
  points_valid_ += statistics.points_valid;
  points_static_ += statistics.points_static;
  points_dynamic_ += statistics.points_dynamic;
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    dropped_[i] += statistics.dropped[i];
    keyframes_dropping_[i] += statistics.dropped[i] > 0 ? 1 : 0;
  }
}

void RunStatistics::add_repeat(const KeyframeStatistics& statistics) {
  ++repeats_;
  count(statistics);
}

void RunStatistics::add_keyframe(const KeyframeView& keyframe, std::int64_t duration_ns) {
  ++keyframes_;
  if (keyframe.statistics == nullptr) return;
  const KeyframeStatistics& statistics = *keyframe.statistics;
  count(statistics);
  dynamic_cells_ += statistics.dynamic_cells;
  if (statistics.up_known) odometry_tilt_deg_.push_back(statistics.odometry_tilt_deg);
  up_contradicted_ += statistics.up_contradicted ? 1 : 0;
  odometry_contradicted_ += keyframe.odometry_contradicted ? 1 : 0;
  for (std::size_t i = 0; i < kCapacities; ++i) {
    capacity_[i].used = std::max(capacity_[i].used, statistics.capacity[i].used);
    capacity_[i].capacity = std::max(capacity_[i].capacity, statistics.capacity[i].capacity);
  }
  for (std::size_t i = 0; i < kStages; ++i) {
    stage_ms_[i].push_back(statistics.stage_us[i] * 1e-3F);
  }
  sampling_ = statistics.sampling;
  attitude_noise_deg_ = std::max(attitude_noise_deg_, statistics.attitude_noise_deg);
  sweep_tilt_deg_ = std::max(sweep_tilt_deg_, statistics.sweep_tilt_deg);
  aligned_scans_ += statistics.aligned_scans;
  const double total_ns = 1e3 * static_cast<double>(statistics.microseconds(Stage::kTotal));
  const bool too_long = total_ns > static_cast<double>(duration_ns);
  if (too_long || statistics.deadline_missed) ++deadline_misses_;
}

void RunStatistics::add_closing_call(std::int64_t elapsed_ns, bool late) {
  closing_call_ms_.push_back(static_cast<float>(static_cast<double>(elapsed_ns) * 1e-6));
  if (late) ++keyframes_late_;
}

void RunStatistics::add_hand_over(std::int64_t elapsed_ns) {
  hand_over_ms_.push_back(static_cast<float>(static_cast<double>(elapsed_ns) * 1e-6));
}

void RunStatistics::add_relabelled(const RelabelledKeyframe& relabelled) {
  cells_now_dynamic_ += relabelled.cells_now_dynamic;
  cells_now_static_ += relabelled.cells_now_static;
}

void RunStatistics::add_loops(std::size_t candidates, std::size_t accepted) {
  loop_candidates_ += candidates;
  loops_accepted_ += accepted;
}

std::uint64_t RunStatistics::scans_refused() const {
  std::uint64_t sum = 0;
  for (const auto& [cause, count] : refused_) sum += count;
  return sum;
}

std::string RunStatistics::most_frequent_refusal() const {
  const auto most =
      std::max_element(refused_.begin(), refused_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == refused_.end() ? std::string() : most->first;
}

float RunStatistics::odometry_tilt_deg() const {
  std::vector<float> tilts = odometry_tilt_deg_;
  return tilts.empty() ? 0.0F : quantile(std::span(tilts), 0.5);
}

double RunStatistics::relabelled_share() const {
  const std::uint64_t dynamic = dynamic_cells_ + cells_now_dynamic_;
  if (dynamic == 0) return 0.0;
  return static_cast<double>(cells_now_dynamic_ + cells_now_static_) / static_cast<double>(dynamic);
}

double RunStatistics::dynamic_share() const {
  if (points_valid_ == 0) return 0.0;
  return static_cast<double>(points_dynamic_) / static_cast<double>(points_valid_);
}

namespace {

StageTimes times_of(std::vector<float> milliseconds) {
  if (milliseconds.empty()) return {};
  const std::span values(milliseconds);
  return {quantile(values, 0.5), quantile(values, 0.99), quantile(values, 1.0)};
}

/// Rounded to three decimals.
double rounded(float value) { return std::round(static_cast<double>(value) * 1e3) / 1e3; }

/// How many keyframes took how long: edges grow by about a quarter.
Json histogram(const std::vector<float>& values_ms) {
  constexpr std::array<float, 24> kUpperEdges_ms = {
      0.5F, 1.0F,  1.5F,  2.0F,  3.0F,  4.0F,  5.0F,  6.0F,   8.0F,   10.0F,  12.5F,  16.0F,
      20.F, 25.0F, 32.0F, 40.0F, 50.0F, 63.0F, 80.0F, 100.0F, 160.0F, 250.0F, 500.0F, 1000.0F};
  std::array<std::uint64_t, kUpperEdges_ms.size() + 1> counts{};
  for (const float value : values_ms) {
    const auto edge = std::lower_bound(kUpperEdges_ms.begin(), kUpperEdges_ms.end(), value);
    ++counts[static_cast<std::size_t>(edge - kUpperEdges_ms.begin())];
  }
  Json edges = Json::array();
  for (const float edge : kUpperEdges_ms) edges.push_back(static_cast<double>(edge));
  return {{"upper_edge_ms", edges}, {"keyframes", counts}};  // the last count is above all edges
}

Json to_json(const StageTimes& times) {
  return {{"p50", rounded(times.p50_ms)},
          {"p99", rounded(times.p99_ms)},
          {"max", rounded(times.max_ms)}};
}

/// Null where a base did not say.
Json link_json(const lcm_port::PublisherCounters& own) {
  Json json = {{"bytes_per_second", std::round(own.bytes_per_second)},
               {"adapts", own.rate_adapts},
               {"loss", nullptr},
               {"round_trip_ms", nullptr},
               {"window_bytes", nullptr},
               {"clock", nullptr}};
  if (!own.rate_adapts) return json;
  json["loss"] = own.loss;
  json["round_trip_ms"] = static_cast<double>(own.round_trip_ns) * 1e-6;
  json["window_bytes"] = own.window_bytes;
  if (own.clock) {
    json["clock"] = {{"base_minus_robot_ns", own.clock->base_minus_robot_ns},
                     {"uncertainty_ns", own.clock->uncertainty_ns},
                     {"steps", own.clock->steps}};
  }
  return json;
}

/// Where the robot was in the base's map at the end; null if no base has said so.
Json map_pose_json(const std::optional<lcm_port::HeardMapPose>& heard) {
  if (!heard) return nullptr;
  const wire::MapPoseMessage& at = heard->message;
  Json json = {{"epoch", at.epoch},
               {"keyframe", at.sequence},
               {"stamp_ns", at.stamp_ns},
               {"state", map_pose_state_name(at.state)}};
  if (!at.reason.empty()) json["reason"] = at.reason;
  if (at.state != wire::MapPoseState::kLocalised) return json;
  json["T_map_odometry"] = pose_numbers(at.T_map_odometry);
  json["covariance"] = at.covariance;
  json["loops"] = at.loops;
  json["since_loop_m"] = at.since_loop_m;
  return json;
}

Json to_json(const DeliveryCounters& delivery) {
  const lcm_port::PublisherCounters& own = delivery.own;
  const lcm_port::EarlierCounters& earlier = delivery.earlier;
  const spool::SpoolCounters& disk = delivery.disk;
  return {{"keyframes_published", own.keyframes_published},
          {"keyframes_acknowledged", own.keyframes_acknowledged},
          {"keyframes_waiting", own.keyframes_waiting},
          {"keyframes_lost", own.keyframes_lost()},
          {"datagrams_refused", own.send_failures},
          {"link", link_json(own)},
          {"map_pose", map_pose_json(delivery.map_pose)},
          {"map_poses",
           {{"taken", own.map_poses.taken},
            {"of_others", own.map_poses.of_others},
            {"outdated", own.map_poses.outdated},
            {"malformed", own.map_poses.malformed}}},
          {"earlier_sessions",
           {{"sessions", earlier.sessions},
            {"sessions_delivered", earlier.sessions_delivered},
            {"keyframes", earlier.keyframes},
            {"keyframes_acknowledged", earlier.keyframes_acknowledged},
            {"keyframes_lost", earlier.keyframes_lost}}},
          {"spool",
           {{"used", delivery.spooled},
            {"keyframes_written", disk.keyframes_durable},
            {"keyframes_not_written", disk.keyframes_added - disk.keyframes_durable},
            {"keyframes_on_disk", disk.keyframes_on_disk},
            {"bytes_on_disk", disk.bytes_on_disk},
            {"keyframes_lost", disk.keyframes_lost},
            {"keyframes_damaged", disk.keyframes_damaged},
            {"write_failures", disk.write_failures}}}};
}

}  // namespace

StageTimes RunStatistics::stage_times(Stage stage) const {
  return times_of(stage_ms_.at(static_cast<std::size_t>(stage)));
}

std::string RunStatistics::to_json(const Run& run) const {
  Json json;
  json["scans"] = scans_;
  json["keyframes"] = keyframes_;
  json["points_in"] = points_in_;
  json["points_valid"] = points_valid_;
  json["points_static"] = points_static_;
  json["points_dynamic"] = points_dynamic_;
  json["dynamic_share"] = dynamic_share();
  json["relabelled"] = {{"cells_now_dynamic", cells_now_dynamic_},
                        {"cells_now_static", cells_now_static_},
                        {"share", relabelled_share()}};
  json["allocations_after_start"] = run.allocations_after_start;
  json["arena_bytes"] = run.arena_bytes;

  Json& dropped = json["dropped"] = Json::object();
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    dropped[std::string(drop_cause_name(static_cast<DropCause>(i)))] = dropped_[i];
  }
  dropped["too_far_for_message"] = encoding_.left_out;
  Json& dropping = json["keyframes_dropping"] = Json::object();
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    dropping[std::string(drop_cause_name(static_cast<DropCause>(i)))] = keyframes_dropping_[i];
  }
  Json& refused = json["scans_refused"] = Json::object();
  for (const auto& [cause, count] : refused_) refused[cause] = count;

  Json& capacity = json["capacity"] = Json::object();
  for (std::size_t i = 0; i < kCapacities; ++i) {
    capacity[std::string(capacity_name(static_cast<Capacity>(i)))] = {
        {"used", capacity_[i].used}, {"capacity", capacity_[i].capacity}};
  }
  json["sampling"] = {{"ray_spacing_deg", rounded(sampling_.ray_spacing_deg)},
                      {"ring_spacing_deg", rounded(sampling_.ring_spacing_deg)},
                      {"rays_differ", sampling_.rays_differ},
                      {"elevations_differ", sampling_.elevations_differ},
                      {"image_elevation_min_deg", rounded(sampling_.image_elevation_min_deg)},
                      {"image_elevation_max_deg", rounded(sampling_.image_elevation_max_deg)},
                      {"mode_changes", sampling_.changes}};
  json["surroundings"] = {{"setting", run.surroundings}, {"extent_m", rounded(run.extent_m)}};
  json["input"] = apps::findings_json(run.input);
  json["attitude_noise_deg"] = rounded(attitude_noise_deg());
  json["sweep_tilt_deg"] = rounded(sweep_tilt_deg_);
  json["aligned_scans"] = aligned_scans_;
  json["keyframes_odometry_contradicted"] = odometry_contradicted_;
  json["keyframes_repeated"] = repeats_;
  const std::uint64_t count = std::max<std::uint64_t>(encoding_.encoded, 1);
  json["message_bytes_per_keyframe"] = {{"all", encoding_.bytes / count},
                                        {"free_space_images", encoding_.image_bytes / count}};
  json["loops"] = {{"candidates", loop_candidates_}, {"accepted", loops_accepted_}};

  json["up"] = {{"known", keyframes_up_known()},
                {"unknown", keyframes_ - keyframes_up_known()},
                {"contradicted", keyframes_up_contradicted()},
                {"odometry_tilt_deg", rounded(odometry_tilt_deg())}};

  Json& stages = json["stage_ms"] = Json::object();
  for (std::size_t i = 0; i < kStages; ++i) {
    const auto stage = static_cast<Stage>(i);
    stages[std::string(stage_name(stage))] = apps::to_json(stage_times(stage));
  }
  json["load"] = load_json(run.load);
  json["total_histogram"] = histogram(stage_ms_[static_cast<std::size_t>(Stage::kTotal)]);
  json["deadline_misses"] = deadline_misses_;
  json["closing_call_ms"] = apps::to_json(times_of(closing_call_ms_));
  json["hand_over_ms"] = apps::to_json(times_of(hand_over_ms_));
  json["files_not_written"] = run.files_not_written;
  json["keyframes_not_encoded"] = encoding_.handed_over - encoding_.encoded;
  json["realtime"] = run.realtime;
  json["workers"] = run.workers;
  json["sessions"] = run.sessions;
  json["scans_left_out"] = run.scans_left_out;
  json["keyframes_late"] = keyframes_late_;
  const lcm_port::PublisherCounters& own = run.delivery.own;
  json["published"] = run.delivery.published;
  json["keyframes_acknowledged"] = own.keyframes_acknowledged;
  json["keyframes_not_published"] = own.keyframes_lost();
  json["pieces_resent"] = own.pieces_resent;
  json["delivery"] = apps::to_json(run.delivery);
  return json.dump(2) + "\n";
}

}  // namespace unimapper::apps
