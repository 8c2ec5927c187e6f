// Whole run of a fleet: scans, keyframes, messages with losses, merge and export
#include "fleet.hpp"

#include "expected_text.hpp"
#include "merge_words.hpp"
#include "onboard_words.hpp"
#include "ports/lcm/session_log.hpp"
#include "tests/apps/command.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/keyframe_level.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"
#include "unimapper/wire/pieces.hpp"
#include "wire_words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

/// No parameter that decides about something has its default.
PipelineConfig robot_config() {
  PipelineConfig config = preset(SensorKind::kOs1_64);
  config.keyframe.scans = 3;
  config.keyframe.range_min_m = 1.5F;
  config.keyframe.range_max_m = 42.0F;
  config.keyframe.max_points_per_scan = 12000;
  config.voxel.fine_size_m = 0.25F;
  config.voxel.max_cells = 1U << 15U;
  config.voxel.max_voxels = 1U << 13U;
  config.voxel.max_window_blocks = 1U << 14U;
  config.ground.margin_m = 0.08F;
  config.free_space.images_per_keyframe = 2;
  config.free_space.azimuth_resolution_deg = 1.2F;
  config.free_space.elevation_resolution_deg = 1.5F;
  config.free_space.range_margin_m = 0.6F;
  config.removal.window = 5;
  config.removal.log_odds_free = 0.9F;
  config.removal.log_odds_occupied = 0.5F;
  config.descriptor.max_keypoints = 90;
  config.descriptor.column_size_m = 0.35F;
  config.descriptor.range_m = 35.0F;
  config.loop_search.max_places = 24;
  config.loop_search.side_tolerance_m = 0.25F;
  config.loop_search.accept_confidence = 0.9F;
  config.search_scope.min_keyframe_gap = 6;
  return config;
}

merge::MergeConfig base_config() {
  merge::MergeConfig config;
  config.threads = 2;
  config.odometry.translation_m_per_sqrt_m = 0.03;
  config.odometry.rotation_rad_per_sqrt_m = 0.0012;
  config.registration.leaf_m = 0.5F;
  config.registration.max_source_points = 2500;
  config.loops.min_keyframe_gap = 6;
  config.loops.min_path_gap_m = 15.0;
  config.loops.max_candidates_per_pair = 40;
  config.loops.min_overlap = 0.4;
  config.acceptance.min_span_m = 12.0;
  config.acceptance.distinct_m = 3.0;
  config.graph.cauchy_scale = 2.5;
  config.radius.radius_m = 7.0;
  config.refinement.window = 4;
  config.refinement.revisits = 6;
  config.refinement.cell_size_m = 0.25F;
  config.map.voxel_size_m = 0.3F;
  config.map.change_distance_m = 0.6F;
  config.map.change_range_m = 25.0F;
  config.map.min_cluster = 4;
  return config;
}

/// A sent keyframe and what the robot knew of it.
struct Sent {
  std::vector<wire::EncodedKeyframe> keyframes;
  std::string text;
};

Sent run(const test::Scene& scene, const Robot& robot, const PipelineConfig& config) {
  const SensorPath path = regression::drive(robot);
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  MemoryBlock memory(wire::KeyframeEncoder::required_bytes(config.voxel.max_cells));
  auto encoder = wire::KeyframeEncoder::create(config.voxel.max_cells, memory.span());
  REQUIRE(encoder);
  test::Scene street = scene;
  Sent sent;
  sent.text = "session " + robot.info.name + "\n";
  std::vector<test::LabelledScan> scans;
  const auto send = [&] {
    const KeyframeView& view = pipeline->keyframe();
    sent.text += keyframe_text(view);
    // Labels against the truth.
    std::size_t counts[3][3] = {};
    for (std::size_t s = 0; s < view.scans.size(); ++s) {
      const test::LabelledScan& scan = scans[view.scans[s].scan_index];
      std::vector<PointLabel> labels(scan.points.size());
      REQUIRE(pipeline->labels(s, labels) == labels.size());
      for (std::size_t i = 0; i < labels.size(); ++i) {
        ++counts[scan.truth[i] == test::Truth::kDynamic ? 1 : 0][static_cast<int>(labels[i])];
      }
    }
    for (const std::size_t dynamic : {0U, 1U}) {
      sent.text += line_of(dynamic != 0 ? "  moving points labelled" : "  standing points labelled",
                           counts[dynamic][0], counts[dynamic][1], counts[dynamic][2]);
    }
    wire::EncodedKeyframe keyframe;
    keyframe.session = robot.info.id;
    keyframe.sequence = view.sequence;
    keyframe.stamp_ns = view.scans.back().stamp_ns;
    keyframe.bytes.resize(1U << 20U);
    const wire::EncodeResult encoded = encoder.value().encode(view, robot.info.id, keyframe.bytes);
    REQUIRE(encoded.error.ok());
    keyframe.bytes.resize(encoded.bytes);
    // No checksum: the last bits of poses differ between -O1 and -O3.
    sent.text += line_of("  encoded", encoded.bytes, "images", encoded.image_bytes, "left out",
                         encoded.left_out);
    sent.keyframes.push_back(std::move(keyframe));
  };
  for (std::size_t i = 0; i < path.T_scene_sensor.size(); ++i) {
    const double t = robot.start_s + 0.1 * static_cast<double>(i);
    if (i == robot.half_the_columns_from) street.columns /= 2;
    scans.push_back(street.scan(path.T_scene_sensor[i], t));
    const auto stamp_ns = static_cast<std::int64_t>(std::llround(t * 1e9));
    const ScanResult result =
        pipeline->add_scan(scans.back().view(), path.T_odometry_sensor[i], stamp_ns);
    REQUIRE(result.error.ok());
    if (result.keyframe_ready) send();
  }
  if (pipeline->flush().keyframe_ready) send();
  while (pipeline->relabel_next()) {
    sent.text += relabelled_text("at the end relabelled", pipeline->keyframe().relabelled);
  }
  return sent;
}

std::string receiver_text(const wire::Receiver& receiver) {
  std::string text = counters_text(receiver.counters());
  for (const wire::SessionProgress& one : receiver.progress()) {
    text += line_of("progress of", one.info.name, one.info.sensor, one.ended ? "ended" : "running",
                    one.whole ? "whole" : "not whole", "announced", one.announced, "received",
                    one.received);
  }
  return text;
}

std::string session_text(const SessionData& session) {
  std::string text = line_of("session", session.info.name, session.info.id.robot,
                             wire::to_text(session.info.id.boot), session.info.sensor,
                             session.complete ? "complete" : "incomplete", "missing",
                             session.keyframes_missing, "damaged", session.keyframes_damaged);
  for (const KeyframeRecord& k : session.keyframes) {
    text += line_of("  keyframe", k.sequence, k.T_odometry_keyframe, up_text(k.up), "points in",
                    k.points_in, "dynamic", k.points_dynamic, "left out", k.left_out, "images",
                    k.images.size(), "keypoints", k.keypoints.size(), "planes", k.planes.size()) +
            "    static " + cells_text(k.static_cells) + "\n    dynamic " +
            cells_text(k.dynamic_cells) + "\n";
  }
  return text;
}

/// The numbers of a file's lines to three decimals, everything else as it is.
std::string rounded_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  std::string word;
  const auto finish = [&] {
    char* end = nullptr;
    const bool decimal = word.find('.') != std::string::npos;
    const double value = decimal ? std::strtod(word.c_str(), &end) : 0.0;
    const bool number = decimal && end == word.c_str() + word.size();
    text += !number ? word : std::abs(value) < 1e4 ? fixed(value, 3) : rough(value);
    word.clear();
  };
  for (char c; stream.get(c);) {
    if (std::strchr(" ,\n", c) == nullptr) {
      word += c;
      continue;
    }
    finish();
    text += c;
  }
  finish();
  return text;
}

struct Fleet {
  std::vector<Robot> robots;
  std::vector<test::Scene> scenes;  ///< by robot
};

/// alpha drives out and back past a van, beta a part of it the other way round on another day, when
/// a kiosk stands there instead of the van, gamma in the cross direction, delta in another town.
Fleet make_fleet() {
  Fleet fleet;
  test::Scene first = make_street(7);
  test::Scene second = first;
  first.boxes.push_back(test::standing_box({31.0, 4.0, 1.1}, {2.4, 1.0, 1.1}));
  second.boxes.push_back(test::standing_box({14.0, -3.9, 1.3}, {1.2, 1.1, 1.3}));
  fleet.scenes = {first, second, second, make_street(99)};
  Robot robot;
  robot.info = {{3, 1001}, "alpha", "os1-64"};
  robot.corners = {{0.0, -0.8}, {58.0, -0.8}, {58.0, 1.2}, {4.0, 1.2}};
  robot.T_vehicle_sensor = turned(2.0, 5.0, 12.0, {0.4, -0.2, 1.9});
  robot.T_odometry_scene = turned(3.0, -4.0, 130.0, {120.0, -75.0, 14.0});
  robot.start_s = 1000.0;
  fleet.robots.push_back(robot);
  robot.info = {{4, 2002}, "beta", "os1-64"};
  robot.corners = {{55.0, 0.9}, {9.0, 0.6}};
  robot.T_vehicle_sensor = turned(-1.5, 3.0, -20.0, {0.1, 0.3, 1.6});
  robot.T_odometry_scene = turned(-2.0, 3.0, -75.0, {-40.0, 260.0, -8.0});
  robot.start_s = 5000.25;
  fleet.robots.push_back(robot);
  robot.info = {{4, 3003}, "gamma", "os1-64"};
  robot.corners = {{12.0, -1.2}, {50.0, 0.4}};
  robot.T_vehicle_sensor = turned(1.0, -2.0, 170.0, {0.0, 0.0, 2.1});
  robot.T_odometry_scene = turned(1.0, 1.5, 20.0, {7.0, 9.0, 31.0});
  robot.start_s = 9000.5;
  fleet.robots.push_back(robot);
  fleet.robots.back().half_the_columns_from = 12;
  robot.info = {{9, 4004}, "delta", "os1-64"};
  robot.corners = {{0.0, 0.0}, {26.0, 0.0}};
  fleet.robots.push_back(robot);
  return fleet;
}

/// What the command-line tool makes of the logs of two robots, in words: paths and times left out.
std::string tool_text(const Fleet& fleet, const std::vector<Sent>& sent) {
  const TemporaryDirectory scratch;
  std::vector<std::string> arguments{"merge"};
  for (const std::size_t r : {1U, 2U}) {
    const auto log = scratch.path() / (fleet.robots[r].info.name + ".lcmlog");
    lcm_port::SessionLogWriter writer(log, fleet.robots[r].info, 1200);
    for (wire::EncodedKeyframe keyframe : sent[r].keyframes) {
      if (r == 1 && keyframe.sequence == 4) continue;
      if (r == 2 && keyframe.sequence == 2) keyframe.bytes[0] ^= 1U;  // no keyframe any more
      writer.write(keyframe);
    }
    if (r == 1) writer.finish();
    arguments.push_back(log.string());
  }
  apps::write_text(scratch.path() / "config.json",
                   R"({"threads": 2, "registration": {"leaf_m": 0.5},
                       "acceptance": {"min_span_m": 10}, "refinement": {"cell_size_m": 0.25}})");
  for (const std::string word : {"--config", "config.json", "--out", "map"}) {
    arguments.push_back(word[0] == '-' ? word : (scratch.path() / word).string());
  }
  const apps::CommandResult result = apps::run_unimapper(arguments);
  CHECK(result.exit_code == 0);
  std::istringstream said(result.out + result.err + "summary.json\n" +
                          apps::read_text(scratch.path() / "map" / "summary.json"));
  std::string text;
  for (std::string line; std::getline(said, line);) {
    for (std::size_t at; (at = line.find(scratch.path().string())) != std::string::npos;) {
      line.replace(at, scratch.path().string().size(), "FOLDER");
    }
    // "unimapper:    1.2 s  stage"
    const std::size_t time = line.find(" s  ");
    if (line.rfind("unimapper: ", 0) == 0 && time != std::string::npos) {
      line = "unimapper: " + line.substr(time + 4);
    }
    text += line + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("a fleet's whole run gives what it gave before", "[regression][slow]") {
  const Fleet fleet = make_fleet();
  std::vector<Sent> sent;
  for (std::size_t r = 0; r < fleet.robots.size(); ++r) {
    PipelineConfig config = robot_config();
    if (r == 2) config.odometry.up_sigma_deg = 4.0F;
    sent.push_back(run(fleet.scenes[r], fleet.robots[r], config));
    check_expected("fleet_" + fleet.robots[r].info.name, sent.back().text);
  }

  // Everything in pieces that overtake each other; some are lost, damaged or sent twice.
  Random random(77);
  wire::ReceiverLimits limits;
  limits.max_pending_keyframes = 40;
  wire::Receiver receiver(limits);
  std::vector<wire::ChunkMessage> pieces;
  for (std::size_t r = 0; r < sent.size(); ++r) {
    receiver.receive(
        wire::SessionMessage{fleet.robots[r].info, wire::SessionState::kStarted, 0, 0});
    for (const wire::EncodedKeyframe& keyframe : sent[r].keyframes) {
      for (wire::ChunkMessage& piece :
           wire::cut_into_pieces(keyframe, 1500U + 100U * static_cast<std::uint32_t>(r))) {
        const bool lost = r == 1 && keyframe.sequence == 3 && piece.index == 2;
        if (r == 0 && keyframe.sequence == 9 && piece.index == 1) piece.data[7] ^= 0x20U;
        if (lost) continue;
        if (random.below(40) == 0) pieces.push_back(piece);
        pieces.push_back(std::move(piece));
      }
    }
  }
  for (std::size_t i = pieces.size(); i > 1; --i) {
    // Nothing is overtaken by more than 60 pieces.
    std::swap(pieces[i - 1], pieces[i - 1 - random.below(std::min<std::size_t>(i, 60))]);
  }
  for (wire::ChunkMessage& piece : pieces) receiver.receive(std::move(piece));
  for (std::size_t r = 0; r + 1 < sent.size(); ++r) {
    receiver.receive(wire::SessionMessage{fleet.robots[r].info, wire::SessionState::kEnded,
                                          sent[r].keyframes.size() + (r == 1 ? 2 : 0),
                                          r == 1 ? 2U : 0U});
  }
  SessionInfo renamed = fleet.robots[0].info;
  renamed.name = "omega";
  receiver.receive(wire::SessionMessage{renamed, wire::SessionState::kEnded, 900, 0});
  receiver.count_malformed();
  std::string received = receiver_text(receiver);
  std::vector<SessionData> sessions = receiver.take_sessions();
  for (SessionData& session : sessions) {
    // As if the robot had not known up everywhere.
    for (const std::size_t k : {0U, 1U, 5U}) {
      if (session.info.name == "beta") session.keyframes[k].up = {};
    }
    received += "levelled " + count(merge::level_keyframes(session.keyframes)) + "\n";
    received += session_text(session);
  }
  check_expected("fleet_received", received);

  const merge::MergeResult result = merge::merge_sessions(sessions, base_config());
  check_expected_of_optimisation("fleet_merged", merge_text(sessions, result));

  const TemporaryDirectory scratch;
  merge::export_map(scratch.path(), sessions, result);
  std::string exported;
  for (const char* file :
       {"summary.json", "loops.csv", "graph.g2o", "trajectories/alpha.tum", "trajectories/beta.tum",
        "trajectories/gamma.tum", "unconnected/delta.tum"}) {
    if (!std::filesystem::exists(scratch.path() / file)) continue;
    exported += std::string("file ") + file + "\n" + rounded_file(scratch.path() / file);
  }
  for (const char* file : {"map.ply", "changes.ply"}) {
    exported += line_of("file", file, std::filesystem::file_size(scratch.path() / file));
  }
  check_expected_of_optimisation("fleet_exported", exported);
  check_expected_of_optimisation("fleet_tool", tool_text(fleet, sent));
}
