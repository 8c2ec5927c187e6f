// Clouds, labels and maps of a merge on tilted input, with parameters that are not the default
#include "expected_text.hpp"
#include "merge_words.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "src/merge/map/changes.hpp"
#include "src/merge/map/unified_map.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/registration/registration.hpp"
#include "src/merge/sessions/central_score.hpp"
#include "src/merge/sessions/keyframe_free_space.hpp"
#include "src/merge/sessions/seen_extent.hpp"
#include "tests/test.hpp"
#include "tilted_scenes.hpp"
#include "unimapper/merge/refinement.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::regression;

TEST_CASE("registration of tilted clouds, as before", "[regression]") {
  RegistrationConfig config;
  config.leaf_m = 0.35F;
  config.max_source_points = 1500;
  std::string text;
  Random random(61);
  for (int round = 0; round < 3; ++round) {
    const Pose T_world_target = turned(4.0, -3.0, 60.0 * round, {1.0, -0.6, 1.7});
    const Pose T_world_source = turned(-5.0, 2.0, 60.0 * round + 35.0, {-1.5, 0.9, 1.2});
    const Corner a = corner(random, T_world_target.inverse(), 0.02);
    const Corner b = corner(random, T_world_source.inverse(), 0.03);
    const RegistrationCloud target(a.points, a.ground, config);
    const RegistrationCloud source(b.points, b.ground, config);
    CloudMoments covariances;
    CloudMoments points;
    std::size_t ground = 0;
    for (std::size_t i = 0; i < source.size(); ++i) {
      const Eigen::Matrix3f& c = source.covariance(i);
      covariances.add(1000.0F * c.diagonal());
      covariances.add(1000.0F * Eigen::Vector3f(c(0, 1), c(0, 2), c(1, 2)));
      points.add(source.points()[i]);
      ground += source.is_ground(i) ? 1 : 0;
    }
    text += "cloud " + points.text() + " ground " + count(ground) + "\n  covariances " +
            covariances.text(2) + "\n";
    const Pose truth = T_world_target.inverse() * T_world_source;
    const Pose start = truth * turned(1.0, -1.5, 4.0, {0.5, -0.4, 0.2});
    Eigen::Matrix2d tilt;
    tilt << 2000.0, 500.0, 500.0, 900.0;
    for (const double weight : {0.0, 1.0}) {
      const RegistrationResult result =
          register_clouds(target, source, start, config, weight * tilt);
      text += line_of("registered", result.converged ? "converged" : "not", "in", result.iterations,
                      "matched", result.matched, "rmse", fixed(result.rmse_m, 5), "condition",
                      rough(result.condition)) +
              "  " + pose_text(result.T_target_source) + "\n  error " +
              pose_text(truth.inverse() * result.T_target_source) + "\n  " +
              information_text(result.information) + "\n";
    }
    for (const double distance_m : {0.2, 0.5, 1.5}) {
      text +=
          line_of("  overlap", fixed(structure_overlap(target, source, truth, 11.0, distance_m), 4),
                  fixed(structure_overlap(target, source, start, 30.0, distance_m), 4));
    }
  }
  check_expected("merge_registration", text);
}

TEST_CASE("refinement of labels in a tilted map, as before", "[regression]") {
  Random random(71);
  const Pose T_map_sensor = turned(12.0, -17.0, 100.0, {31.0, -12.0, 8.0});
  RefinementConfig config;
  config.window = 3;
  config.revisits = 4;
  config.reach_m = 12.0F;
  config.cell_size_m = 0.25F;
  // A person leaves, a crate stands although the robot removed it, and a second visit sees neither.
  std::vector<Pose> poses[3];
  SessionData first = looking(random, 3, {kWall, kPerson}, {kCrate}, poses[0], T_map_sensor);
  append(first, looking(random, 5, {kWall, kCrate}, {}, poses[0], T_map_sensor));
  SessionData second = looking(random, 3, {kWall}, {}, poses[1], T_map_sensor);
  append(second, looking(random, 1, {kWall, kPerson}, {kCrate}, poses[1], T_map_sensor));
  append(second, looking(random, 2, {kWall}, {}, poses[1], T_map_sensor));
  SessionData apart = looking(random, 2, {kWall, kPerson}, {kCrate}, poses[2], T_map_sensor);
  append(apart, looking(random, 1, {kWall}, {}, poses[2], T_map_sensor));
  const std::vector<PosedSession> posed{
      {&first, poses[0], 0}, {&second, poses[1], 0}, {&apart, poses[2], 1}};
  std::string text;
  const auto refined = refine(posed, config, 2);
  for (std::size_t s = 0; s < 3; ++s) {
    MergedSession merged;
    merged.refined = refined[s];
    text += "session " + count(s) + "\n" + refined_text(*posed[s].session, merged);
    for (std::size_t k = 0; k < refined[s].size(); ++k) {
      CloudMoments dynamic;
      visit_cells(posed[s].session->keyframes[k], refined[s][k], true, [&](const FineCell& cell) {
        dynamic.add((posed[s].T_map_keyframe[k] * Eigen::Vector3d(cell.position.cast<double>()))
                        .cast<float>());
      });
      text += "  dynamic " + dynamic.text() + "\n";
    }
  }
  check_expected("merge_refined", text);
}

TEST_CASE("map and changes in a tilted map, as before", "[regression]") {
  Random random(81);
  const Pose T_map_sensor = turned(-11.0, 14.0, -140.0, {-21.0, 33.0, -5.0});
  MergeConfig config;
  config.threads = 2;
  config.map.voxel_size_m = 0.25F;
  config.map.change_distance_m = 0.4F;
  config.map.change_range_m = 11.0F;
  config.map.min_cluster = 5;
  std::vector<MergedSession> merged(3);
  std::vector<SessionData> sessions;
  sessions.push_back(
      looking(random, 4, {kWall, kPerson}, {}, merged[0].T_map_keyframe, T_map_sensor));
  sessions.push_back(
      looking(random, 5, {kWall, kCrate}, {kPerson}, merged[1].T_map_keyframe, T_map_sensor));
  sessions.push_back(looking(random, 4, {kWall}, {}, merged[2].T_map_keyframe, T_map_sensor));
  std::vector<SessionVoxels> voxels;
  std::string text;
  for (std::size_t s = 0; s < 3; ++s) {
    // Of the third session, the first day, a robot of an older version sends no images.
    const std::int64_t day = s == 2 ? 0 : static_cast<std::int64_t>(s) + 1;
    for (KeyframeRecord& keyframe : sessions[s].keyframes) {
      keyframe.scans[0].stamp_ns += day * 1000000;
      if (s == 2) keyframe.images.clear();
    }
    merged[s].status = SessionStatus::kMerged;
    merged[s].refined.resize(sessions[s].keyframes.size());
    voxels.push_back(voxelise(sessions[s], merged[s], config.map.voxel_size_m).fixed);
    const SessionVoxels removed = voxelise(sessions[s], merged[s], config.map.voxel_size_m).dynamic;
    CloudMoments moments[2];
    const SessionVoxels* const kinds[] = {&voxels[s], &removed};
    for (int kind = 0; kind < 2; ++kind) {
      kinds[kind]->visit([&](VoxelKey key, const SessionVoxels::Voxel& voxel) {
        moments[kind].add(voxel.position(key, config.map.voxel_size_m));
      });
    }
    text += "voxels " + moments[0].text() + "\n  removed " + moments[1].text() + "\n";
  }
  MergeResult result;
  result.map = unite({&voxels[0], &voxels[1], &voxels[2]});
  result.changes =
      find_changes(sessions, merged, {&voxels[0], &voxels[1], &voxels[2]}, config).points;
  text += merge_text({}, result);
  // Who saw how far, and who would be the central one.
  for (const SessionData& session : sessions)
    text += "extent " + fixed(seen_extent_m(session), 4) + "\n";
  std::vector<LoopConstraint> loops(3);
  loops[0].query = {0, 3};
  loops[0].match = {0, 1};
  loops[0].decision.accepted = true;
  loops[1].query = {1, 0};
  loops[1].match = {1, 4};
  loops[2].query = {2, 3};
  loops[2].match = {2, 0};
  loops[2].decision.accepted = true;
  for (const double score : central_scores(sessions, loops))
    text += "score " + fixed(score, 5) + "\n";
  for (const SessionData& session : sessions) {
    const KeyframeFreeSpace space(session.keyframes[1], WithoutImages::kPaintFromCells);
    text += "field of view " + fixed(space.field_of_view(), 6) + "\n";
  }
  check_expected("merge_changes", text);
}

TEST_CASE("verification of loops with every reason to refuse one, as before", "[regression]") {
  // Two sessions of four keyframes in the corner, in leaning, turned frames; the second session's
  // keyframes do not know up as well.
  Random random(111);
  std::vector<SessionData> sessions(2);
  std::vector<Pose> T_world_keyframe[2];
  for (std::size_t s = 0; s < 2; ++s) {
    const Pose T_odometry_world = any_pose(random, 60.0);
    for (std::uint32_t k = 0; k < 4; ++k) {
      const Pose T_world =
          turned(0.3 * k, -0.2 * static_cast<double>(s), 25.0 * k + 70.0 * static_cast<double>(s),
                 {1.1 * k - 2.0, 0.4 * k - 1.0, 1.5 + 0.2 * static_cast<double>(s)});
      T_world_keyframe[s].push_back(T_world);
      KeyframeRecord& keyframe = sessions[s].keyframes.emplace_back();
      keyframe.sequence = k;
      keyframe.T_odometry_keyframe = T_odometry_world * T_world * random.pose(0.01, 0.001);
      keyframe.scans.push_back({k, k, keyframe.T_odometry_keyframe});
      keyframe.up = {true, s == 0 ? 4e-5F : 2e-4F, 1e-5F, s == 0 ? 6e-5F : 9e-5F};
      const Corner c = corner(random, T_world.inverse(), 0.02);
      for (std::size_t i = 0; i < c.points.size(); ++i) {
        keyframe.static_cells.push_back({c.points[i], 3, c.ground[i], 0});
      }
    }
  }
  // In the last one's free space the others have a wall.
  for (FineCell& cell : sessions[1].keyframes[3].static_cells) {
    if (cell.ground == 0) cell.position *= 1.5F;
  }
  std::vector<LoopCandidate> candidates;
  const auto propose = [&](std::size_t q, std::size_t m, const Pose& error) {
    LoopCandidate candidate;
    candidate.query = {1, q};
    candidate.match = {0, m};
    candidate.T_match_query = T_world_keyframe[0][m].inverse() * T_world_keyframe[1][q] * error;
    candidate.confidence = 0.5F + 0.1F * static_cast<float>(q);
    candidates.push_back(candidate);
  };
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Zero();
  propose(0, 1, turned(0.3, -0.2, 2.0, {0.3, 0.2, -0.1}));
  propose(1, 2, turned(0.0, 0.0, 6.0, {0.9, -0.6, 0.0}));
  propose(2, 0, turned(7.0, -6.0, 0.0, nowhere));
  propose(2, 3, turned(0.0, 0.0, 90.0, {6.0, 3.0, 0.0}));
  propose(3, 3, turned(0.0, 0.0, 0.0, nowhere));
  candidates.push_back(candidates.front());
  candidates.back().T_match_query.rotation *= 1.2;
  const auto verified = [&](const std::string& name, const MergeConfig& config,
                            const CorrectionLimit& limit) {
    KeyframeClouds clouds(sessions, config.registration, 2);
    std::string text = name + "\n";
    for (const LoopConstraint& loop : verify_loops(candidates, limit, clouds, config)) {
      text += loop_text(loop);
    }
    return text + "  points of a cloud " + count(clouds.cloud({0, 1})->size()) + "\n";
  };
  MergeConfig config;
  config.threads = 2;
  config.registration.leaf_m = 0.5F;
  config.registration.max_points = 5000;
  config.registration.max_source_points = 2000;
  config.loops.min_overlap = 0.3;
  const CorrectionLimit wide{4.0, 0.3};
  std::string text = verified("as configured", config, wide);
  text += verified("small corrections", config, {0.2, 0.3});
  text += verified("small turns", config, {4.0, 0.02});
  MergeConfig strict = config;
  strict.loops.min_overlap = 0.97;
  text += verified("large overlap", strict, wide);
  strict = config;
  strict.loops.max_contradiction = 0.02;
  text += verified("no structure in free space", strict, wide);
  check_expected("merge_verified", text);
}
