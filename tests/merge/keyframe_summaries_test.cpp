// Tests of merging sessions of which mostly summaries have arrived.
#include "unimapper/merge/keyframe_summaries.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "src/merge/keyframe_clouds.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/merge/plane_restorer.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using unimapper::merge::testing::Drive;
using unimapper::merge::testing::drive_roads;
using unimapper::merge::testing::make_town;
using unimapper::merge::testing::record;
using unimapper::merge::testing::Town;

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

/// Largest distance of any keyframe from the truth, in the frame of the first session.
double worst_error_m(const std::vector<Drive>& drives, const MergeResult& result) {
  const Pose T_map_world = result.sessions[0].T_map_keyframe[0] * drives[0].truth[0].inverse();
  double worst = 0.0;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    for (std::size_t k = 0; k < drives[s].truth.size(); ++k) {
      const Pose truth = T_map_world * drives[s].truth[k];
      const Eigen::Vector3d& at = result.sessions[s].T_map_keyframe[k].translation;
      worst = std::max(worst, (truth.translation - at).norm());
    }
  }
  return worst;
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
  const Town town = make_town(1, 2);
  const std::vector<Drive> drives{
      record(town, drive_roads({{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}, {0.5, 0}}), "alpha", 11),
      record(town, drive_roads({{2, 1}, {0, 1}, {0, 0}}), "beta", 12)};
  const Drive elsewhere =
      record(make_town(99, 2), drive_roads({{0, 0}, {1, 0}, {1, 1}}), "other-town", 13);
  const std::size_t period = GENERATE(4, 8);
  std::vector<SessionData> sessions{drives[0].session, over_thin_link(drives[1].session, period),
                                    over_thin_link(elsewhere.session, period)};
  for (SessionData& session : sessions) include_summaries(session);
  const MergeResult result = merge_sessions(sessions, MergeConfig{});
  const Loops loops = accepted_loops(sessions, result);
  CHECK(is_in_map(result.sessions[1].status));
  CHECK(result.sessions[2].status == SessionStatus::kUnconnected);
  CHECK(loops.of_summaries > loops.all / 3);
  CHECK(worst_error_m(drives, result) < 0.5);
  CHECK(result.sessions[1].T_map_keyframe.size() == drives[1].truth.size());
}
