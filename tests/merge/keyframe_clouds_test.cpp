// Clouds of keyframes, and merges of sessions of which mostly summaries have arrived
#include "src/merge/registration/keyframe_clouds.hpp"

#include "src/merge/loops/loop_fingerprint.hpp"
#include "src/merge/sessions/keyframe_summaries.hpp"
#include "src/merge/sessions/plane_restorer.hpp"
#include "tests/merge/known_map.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/merger.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// Keyframes `apart_m` along x from each other; each saw one spot 2 m above itself, of so many
/// cells, and nothing else.
std::vector<SessionData> spots(std::size_t count, double apart_m, std::size_t cells) {
  std::vector<SessionData> sessions(1);
  for (std::size_t k = 0; k < count; ++k) {
    KeyframeRecord keyframe;
    keyframe.T_odometry_keyframe.translation.x() = apart_m * static_cast<double>(k);
    keyframe.static_cells.assign(cells, {Eigen::Vector3f(0.0F, 0.0F, 2.0F), 3, 0, 0});
    sessions[0].keyframes.push_back(keyframe);
  }
  return sessions;
}

/// Along x, from the keyframe, in ascending order.
std::vector<float> cloud_of(std::size_t keyframe, double apart_m = 10.0, std::size_t cells = 1) {
  const std::vector<SessionData> sessions = spots(9, apart_m, cells);
  const RegistrationConfig config;
  KeyframeClouds clouds(sessions, config, 1);
  clouds.prepare({{0, keyframe}});
  std::vector<float> x_m;
  const auto cloud = clouds.cloud({0, keyframe});
  for (const Eigen::Vector3f& p : cloud->points()) x_m.push_back(p.x());
  std::sort(x_m.begin(), x_m.end());
  return x_m;
}

}  // namespace

TEST_CASE("Two neighbours before and after a keyframe join its cloud, the session's ends as well",
          "[clouds]") {
  CHECK(cloud_of(4) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(0) == std::vector<float>{0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(1) == std::vector<float>{-10.0F, 0.0F, 10.0F, 20.0F});
  CHECK(cloud_of(7) == std::vector<float>{-20.0F, -10.0F, 0.0F, 10.0F});
  CHECK(cloud_of(8) == std::vector<float>{-20.0F, -10.0F, 0.0F});
}

TEST_CASE("Cells beyond the radius are left out of a cloud", "[clouds]") {
  // 49.84 m and 50.04 m to the spots two keyframes away.
  CHECK(cloud_of(4, 24.9).size() == 5);
  CHECK(cloud_of(4, 25.0).size() == 3);
}

TEST_CASE("Neighbours join until the cloud holds enough cells", "[clouds]") {
  // With the nearest two 59997 cells, and 60000.
  CHECK(cloud_of(4, 10.0, 19999).size() == 5);
  CHECK(cloud_of(4, 10.0, 20000).size() == 3);
}

TEST_CASE("A loop's fingerprint is of the keyframes that join its clouds", "[clouds]") {
  const auto print = [](std::size_t cells, std::size_t changed) {
    std::vector<SessionData> sessions = spots(9, 10.0, cells);
    sessions[0].keyframes[changed].static_cells[0].position.z() = 3.0F;
    const MergeConfig config;
    return LoopFingerprints(sessions, config).of({0, 4}, {0, 4}, kDescriptorLimit);
  };
  CHECK(print(19999, 6) != print(19999, 7));
  CHECK(print(20000, 6) == print(20000, 7));
  CHECK(print(20000, 5) != print(20000, 7));
}

namespace {

KeyframeRecord summary_of(KeyframeRecord keyframe) {
  keyframe.is_summary = true;
  keyframe.scans = {keyframe.scans.at(keyframe.reference_scan)};
  keyframe.reference_scan = 0;
  keyframe.static_cells.clear();
  keyframe.dynamic_cells.clear();
  keyframe.images.clear();
  keyframe.planes.clear();
  return keyframe;
}

/// The session of a robot whose link carries one keyframe in `period`.
SessionData over_thin_link(const SessionData& session, std::size_t period) {
  SessionData arrived = session;
  arrived.keyframes.clear();
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    if (k % period == 0) arrived.keyframes.push_back(session.keyframes[k]);
    if (k % period != 0) arrived.summaries.push_back(summary_of(session.keyframes[k]));
  }
  return arrived;
}

struct Loops {
  std::size_t all = 0;
  std::size_t of_summaries = 0;
};

Loops accepted_loops(const std::vector<SessionData>& sessions, const MergeResult& result) {
  Loops loops;
  for (const LoopConstraint& loop : result.loops) {
    if (!loop.decision.accepted) continue;
    const auto is_summary = [&](KeyframeId k) {
      return sessions[k.session].keyframes[k.keyframe].is_summary;
    };
    ++loops.all;
    loops.of_summaries += is_summary(loop.query) || is_summary(loop.match) ? 1 : 0;
  }
  return loops;
}

}  // namespace

TEST_CASE("Summaries take their places among the keyframes", "[summaries]") {
  SessionData session;
  for (const std::uint32_t sequence : {0U, 3U, 4U}) {
    session.keyframes.emplace_back().sequence = sequence;
  }
  for (const std::uint32_t sequence : {1U, 5U}) {
    KeyframeRecord& summary = session.summaries.emplace_back();
    summary.sequence = sequence;
    summary.is_summary = true;
  }
  include_summaries(session);
  CHECK(session.summaries.empty());
  std::vector<std::uint32_t> sequences;
  for (const KeyframeRecord& keyframe : session.keyframes) sequences.push_back(keyframe.sequence);
  CHECK(sequences == std::vector<std::uint32_t>{0, 1, 3, 4, 5});
  CHECK(session.keyframes[1].is_summary);
  CHECK_FALSE(session.keyframes[2].is_summary);
}

TEST_CASE("Whole neighbours are found over summaries, nearest first, and not from far away",
          "[summaries]") {
  using Indices = std::vector<std::size_t>;
  std::vector<KeyframeRecord> keyframes(10);
  CHECK(whole_neighbours(keyframes, 4, 2) == Indices{3, 5, 2, 6});
  CHECK(whole_neighbours(keyframes, 0, 2) == Indices{1, 2});
  CHECK(whole_neighbours(keyframes, 9, 1) == Indices{8});
  for (const std::size_t k : {3U, 5U, 6U}) keyframes[k].is_summary = true;
  CHECK(whole_neighbours(keyframes, 4, 2) == Indices{2, 1, 7, 8});
  CHECK(whole_neighbours(keyframes, 5, 1) == Indices{4, 7});
  keyframes.resize(200);
  for (std::size_t k = 1; k < 200; ++k) keyframes[k].is_summary = true;
  CHECK(whole_neighbours(keyframes, 64, 2) == Indices{0});
  CHECK(whole_neighbours(keyframes, 65, 2).empty());
}

TEST_CASE("The cells about a summary are those of the nearest whole keyframes within reach",
          "[summaries]") {
  SessionData session;
  session.keyframes.resize(7);
  std::vector<KeyframeRecord>& keyframes = session.keyframes;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    keyframes[k].T_odometry_keyframe.translation.x() = 10.0 * static_cast<double>(k);
    keyframes[k].static_cells.push_back({Eigen::Vector3f(0.0F, 1.0F, 2.0F), 3, 1, 0});
  }
  for (const std::size_t k : {2U, 3U, 4U}) {
    keyframes[k].is_summary = true;
    keyframes[k].static_cells.clear();
  }
  const std::vector<FineCell> cells = neighbouring_cells(session, 3);
  REQUIRE(cells.size() == 2);
  CHECK(cells[0].position == Eigen::Vector3f(-20.0F, 1.0F, 2.0F));
  CHECK(cells[1].position == Eigen::Vector3f(20.0F, 1.0F, 2.0F));
  CHECK(cells[0].ground == 1);

  keyframes[1].T_odometry_keyframe.translation.x() = -50.0;  // 80 m before
  CHECK(neighbouring_cells(session, 3).size() == 1);
}

TEST_CASE("A robot of which mostly summaries have arrived is merged, with loops of its summaries",
          "[summaries][slow]") {
  const std::size_t period = GENERATE(4, 8);
  const Drive& monday = map_of_town().drive;
  std::vector<SessionData> sessions{monday.session, over_thin_link(friday().session, period),
                                    over_thin_link(elsewhere(99).session, period)};
  for (SessionData& session : sessions) include_summaries(session);
  const MergeResult result = merge_sessions(sessions, MergeConfig{});
  const Loops loops = accepted_loops(sessions, result);
  CHECK(is_in_map(result.sessions[1].status));
  CHECK(result.sessions[2].status == SessionStatus::kUnconnected);
  CHECK(loops.of_summaries > loops.all / 3);
  CHECK(worst_error_m(result, {&monday, &friday()}) < 0.5);
  CHECK(result.sessions[1].T_map_keyframe.size() == friday().truth.size());
}
