// Graphs and loops of a merge on tilted and turned input, with parameters that are not the default
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "expected_text.hpp"
#include "merge_words.hpp"
#include "src/merge/alignment_problem.hpp"
#include "src/merge/loop_acceptance.hpp"
#include "src/merge/loop_cycle.hpp"
#include "src/merge/map_graph.hpp"
#include "src/merge/map_level.hpp"
#include "src/merge/max_clique.hpp"
#include "src/merge/radius_search.hpp"
#include "src/merge/session_path.hpp"
#include "tilted_scenes.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/pose_graph.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::regression;

namespace {

std::string alignment_text(const Alignment& alignment, const Sessions& s) {
  std::string text = "central " + count(alignment.central) + "\n";
  for (std::size_t i = 0; i < alignment.connected.size(); ++i) {
    text += join("session", count(i), alignment.connected[i] ? "connected" : "apart",
                 alignment.reason[i]) +
            "\n  anchor " + pose_text(alignment.T_map_session[i]) + "\n";
    for (const Pose& pose : alignment.T_session_keyframe[i]) {
      text += "  keyframe " + pose_text(pose) + "\n";
    }
  }
  for (std::size_t i = 0; i < alignment.decisions.size(); ++i) {
    text += join("decision", keyframe_id_text(s.loops[i].query), keyframe_id_text(s.loops[i].match),
                 alignment.decisions[i].accepted ? "accepted" : "refused",
                 alignment.decisions[i].reason) +
            "\n";
  }
  return text;
}

MergeConfig align_config() {
  MergeConfig config;
  config.odometry = some_noise();
  config.acceptance.consistency_chi2 = 20.0;
  config.acceptance.min_span_m = 15.0;
  config.acceptance.distinct_m = 2.5;
  config.acceptance.margin = 1.5;
  config.acceptance.loop_chi2 = 30.0;
  config.graph.cauchy_scale = 2.0;
  config.graph.deformation_floor_m = 1.5;
  return config;
}

/// The maps are smaller than one place.
PlacementCheck confirmed_by_data() {
  return [](const Placement&) { return PlacementEvidence{10, 0, {}}; };
}

}  // namespace

TEST_CASE("drift of a tilted way, as before", "[regression]") {
  Random random(5);
  const std::vector<Pose> way = winding_way(random, 30, 3.0);
  const SessionPath path(way, some_noise());
  const SessionPath corrected = path.with_poses(with_drift(way, random, 0.2, 0.02));
  std::string text = "length " + fixed(path.length_m(), 4) + "\n";
  for (std::size_t i = 0; i < way.size(); i += 4) {
    for (std::size_t j = 1; j < way.size(); j += 7) {
      const RelativeVariance a = path.variance(i, j);
      const RelativeVariance b = corrected.variance(i, j);
      text += join(count(i), count(j), fixed(path.path_m(j) - path.path_m(i), 4),
                   rough(a.translation * 1e6), rough(a.rotation * 1e6), "corrected",
                   rough(b.translation * 1e6), rough(b.rotation * 1e6)) +
              "\n";
    }
  }
  text += information_text(path.information(3, 21)) + "\n";
  check_expected("merge_path", text);
}

TEST_CASE("consistency of inter-session loops in tilted frames, as before", "[regression]") {
  Sessions s = three_sessions(31);
  const MergeConfig config = align_config();
  std::vector<SessionPath> paths;
  for (const AlignmentSession& session : s.sessions) {
    paths.emplace_back(session.T_odometry_keyframe, config.odometry);
  }
  std::string text;
  for (const auto& [query, match] :
       {std::pair<std::size_t, std::size_t>{1, 0}, {0, 2}, {2, 1}, {0, 0}}) {
    std::vector<LoopConstraint> loops;
    for (const LoopConstraint& loop : s.loops) {
      if (loop.query.session == query && loop.match.session == match) loops.push_back(loop);
    }
    text += "sessions " + count(query) + " in " + count(match) + "\n";
    for (std::size_t i = 0; i < loops.size(); ++i) {
      text += "  chi2";
      for (std::size_t j = 0; j < loops.size(); ++j) {
        text += " " + rough(cycle_chi2(loops[i], loops[j], paths[query], paths[match]));
      }
      text += "\n";
    }
    for (const double extent_m : {0.0, 9.0, 25.0, 50.0}) {
      const AcceptanceConfig scaled = scaled_to_extent(config.acceptance, extent_m);
      text += join("  extent", fixed(extent_m, 0), "span", fixed(scaled.min_span_m, 3), "distinct",
                   fixed(scaled.distinct_m, 3));
      if (query == match) {
        const IntraSessionLoops found = intra_session_consistency(loops, paths[query], scaled);
        text += " accepted";
        for (const std::size_t i : found.accepted) text += " " + count(i);
        text += " waiting";
        for (const std::size_t i : found.waiting) text += " " + count(i);
        text += "\n";
        continue;
      }
      const ConsistencySet set =
          inter_session_consistency(loops, paths[query], paths[match], scaled);
      text += join(" ", state_name(set.state), set.reason, "inliers");
      for (const std::size_t i : set.inliers) text += " " + count(i);
      text += join(" distinct", count(set.distinct), "competing", count(set.competing)) + "\n    " +
              pose_text(set.T_match_session_query_session) + "\n";
    }
  }
  check_expected("merge_consistency", text);
}

TEST_CASE("loops turned round, and residuals of tilted maps, as before", "[regression]") {
  const Sessions s = three_sessions(32);
  MapState state = make_map_state([&] {
    std::vector<SessionPath> paths;
    for (const auto& one : s.sessions) paths.emplace_back(one.T_odometry_keyframe, some_noise());
    return paths;
  }());
  for (std::size_t i = 0; i < 3; ++i) {
    // Somewhere near the truth.
    state.T_map_session[i] = s.truth[i][0] * s.sessions[i].T_odometry_keyframe[0].inverse() *
                             turned(0.2 * static_cast<double>(i), 0.1, 0.3, {0.1, 0.0, 0.2});
  }
  std::string text;
  for (const LoopConstraint& loop : s.loops) {
    const LoopConstraint back = flipped(loop);
    text += loop_text(back);
    text +=
        join("  chi2", rough(loop_chi2(state, loop)), "and back", rough(loop_chi2(state, back))) +
        "\n";
  }
  check_expected("merge_flipped", text);
}

TEST_CASE("pose graphs of tilted maps, as before", "[regression]") {
  Random random(41);
  PoseGraph graph;
  graph.anchors = {{Pose{}, true}, {any_pose(random, 20.0), false}};
  const std::vector<Pose> truth = winding_way(random, 24, 3.0);
  for (std::size_t anchor = 0; anchor < 2; ++anchor) {
    const std::size_t first = graph.nodes.size();
    for (std::size_t i = 0; i < 12; ++i) {
      const Pose in_session =
          graph.anchors[anchor].T_map_session.inverse() * truth[2 * i] * random.pose(0.3, 0.03);
      graph.nodes.push_back({in_session, anchor, i == 0});
      if (i == 0) continue;
      graph.edges.push_back({first + i - 1, first + i,
                             truth[2 * i - 2].inverse() * truth[2 * i] * random.pose(0.03, 0.003),
                             any_information(random, 0.05, 0.004), 0.0});
    }
  }
  for (std::size_t i = 0; i < 12; i += 3) {
    Pose measured = random.pose(0.1, 0.01);
    if (i == 6) measured = measured * turned(10.0, -20.0, 50.0, {3.0, 2.0, -1.0});
    graph.edges.push_back({i, 12 + i, measured, any_information(random, 0.1, 0.01), 1.5});
  }
  graph.edges.push_back({2, 10, truth[4].inverse() * truth[20] * random.pose(0.1, 0.01),
                         any_information(random, 0.1, 0.01), 2.5});
  std::string text = "before " + rough(graph_cost(graph)) + "\n";
  for (const PoseGraph::Edge& edge : graph.edges) text += rough(edge_chi2(graph, edge)) + " ";
  PoseGraph solved = graph;
  const SolveSummary summary = optimize(solved, 40);
  text += join("\nusable", summary.usable ? "yes" : "no", "from", rough(summary.initial_cost), "to",
               rough(summary.final_cost), "cost", rough(graph_cost(solved))) +
          "\n";
  for (const auto& anchor : solved.anchors)
    text += "anchor " + pose_text(anchor.T_map_session) + "\n";
  for (std::size_t i = 0; i < solved.nodes.size(); ++i) {
    text += "node " + pose_text(solved.T_map_node(i)) + "\n";
  }
  check_expected("merge_graph", text);
}

TEST_CASE("alignment of three tilted sessions, as before", "[regression]") {
  const Sessions s = three_sessions(33);
  const MergeConfig config = align_config();
  // The last loops come from a radius search, after alignment.
  const std::span<const LoopConstraint> all(s.loops);
  const Alignment first =
      align_sessions(s.sessions, all.first(s.loops.size() - 6), config, confirmed_by_data());
  std::string text = alignment_text(first, s);
  const Alignment refined = refine_alignment(first, s.sessions, all, config);
  text += "refined\n" + alignment_text(refined, s);
  const auto problem = AlignmentProblem(s.sessions, all, config);
  for (std::size_t i = 0; i < 3; ++i) {
    MapState after = problem.state;
    for (const double moved_m : {1.4, 1.6, 3.0, 6.0, 15.0}) {
      after.T_session_keyframe[i].back().translation =
          problem.state.T_session_keyframe[i].back().translation +
          Eigen::Vector3d(0.6, -0.64, 0.48) * moved_m;
      text +=
          join("session", count(i), "moved", fixed(moved_m, 1),
               deformation_is_plausible(problem.state, after, i, config.graph) ? "plausible"
                                                                               : "implausible") +
          "\n";
    }
  }
  check_expected("merge_alignment", text);
}

TEST_CASE("maximum cliques of random graphs, as before", "[regression]") {
  Random random(3);
  std::string text;
  for (int round = 0; round < 12; ++round) {
    const std::size_t size = 10 + random.below(70);
    const double share = random.uniform(0.2, 0.8);
    AdjacencyMatrix graph(size);
    std::vector<std::size_t> candidates;
    for (std::size_t a = 0; a < size; ++a) {
      if (random.uniform() < 0.9) candidates.push_back(a);
      for (std::size_t b = a + 1; b < size; ++b) {
        if (random.uniform() < share) graph.connect(a, b);
      }
    }
    for (const std::size_t steps : {std::size_t{3}, std::size_t{200000}}) {
      text += join(count(size), "clique");
      for (const std::size_t i : max_clique(graph, candidates, steps)) text += " " + count(i);
      text += "\n";
    }
  }
  check_expected("merge_cliques", text);
}

TEST_CASE("radius search among tilted maps, as before", "[regression]") {
  Sessions s = three_sessions(91);
  MergeConfig config = align_config();
  config.radius.radius_m = 6.5;
  config.loops.min_keyframe_gap = 5;
  config.loops.min_path_gap_m = 12.0;
  const Alignment alignment = align_sessions(s.sessions, s.loops, config, confirmed_by_data());
  std::string text;
  for (const char* narrow : {"os1-64", "livox-avia"}) {
    std::vector<SessionData> sessions(3);
    for (std::size_t i = 0; i < 3; ++i) {
      sessions[i].info.sensor = narrow;
      for (const Pose& pose : s.sessions[i].T_odometry_keyframe) {
        KeyframeRecord& keyframe = sessions[i].keyframes.emplace_back();
        keyframe.T_odometry_keyframe = pose;
      }
    }
    text += join("sensor", narrow) + "\n";
    const std::span<const LoopConstraint> known(s.loops);
    for (const LoopCandidate& candidate :
         find_radius_candidates(sessions, alignment, known.first(12), config)) {
      text += join("  candidate", keyframe_id_text(candidate.query),
                   keyframe_id_text(candidate.match), pose_text(candidate.T_match_query)) +
              "\n";
    }
  }
  std::vector<UpObservation> ups;
  Random random(92);
  for (int i = 0; i < 20; ++i) {
    UpObservation up;
    up.z_axis = (turned(6.0, -3.0, 0.0, Eigen::Vector3d::Zero()) *
                 turned_within(random, 4.0, 0.0, Eigen::Vector3d::Zero()))
                    .rotation.col(2);
    up.up = {i % 4 != 0, static_cast<float>(random.uniform(1e-5, 9e-4)), 1e-6F,
             static_cast<float>(random.uniform(1e-5, 9e-4))};
    ups.push_back(up);
  }
  text += "level " + pose_text({levelling_rotation(ups), Eigen::Vector3d::Zero()}) + "\n";
  check_expected("merge_radius", text);
}
