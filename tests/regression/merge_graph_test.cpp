// Graphs and loops of a merge on tilted and turned input, with parameters that are not the default
#include "expected_text.hpp"
#include "merge_words.hpp"
#include "src/merge/graph/alignment_problem.hpp"
#include "src/merge/graph/map_graph.hpp"
#include "src/merge/loops/loop_acceptance.hpp"
#include "src/merge/loops/loop_cycle.hpp"
#include "src/merge/loops/max_clique.hpp"
#include "src/merge/sessions/session_path.hpp"
#include "tests/test.hpp"
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
    text +=
        line_of("session", i, alignment.connected[i] ? "connected" : "apart", alignment.reason[i]) +
        line_of("  anchor", alignment.T_map_session[i]);
    for (const Pose& pose : alignment.T_session_keyframe[i]) {
      text += line_of("  keyframe", pose);
    }
  }
  for (std::size_t i = 0; i < alignment.decisions.size(); ++i) {
    text += line_of(
        "decision", keyframe_id_text(s.loops[i].query), keyframe_id_text(s.loops[i].match),
        alignment.decisions[i].accepted ? "accepted" : "refused", alignment.decisions[i].reason);
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
      text += join("  extent", fixed(extent_m, 0), "span", scaled.min_span_m, "distinct",
                   scaled.distinct_m);
      if (query == match) {
        const IntraSessionLoops found = intra_session_consistency(loops, paths[query], scaled);
        text +=
            " accepted" + list_text(found.accepted) + " waiting" + list_text(found.waiting) + "\n";
        continue;
      }
      const ConsistencySet set =
          inter_session_consistency(loops, paths[query], paths[match], scaled);
      text += join(" ", state_name(set.state), set.reason, "inliers") + list_text(set.inliers) +
              line_of(" distinct", set.distinct, "competing", set.competing) +
              line_of("   ", set.T_match_session_query_session);
    }
  }
  check_expected("merge_consistency", text);
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
  text += line_of("\nusable", summary.usable ? "yes" : "no", "from", rough(summary.initial_cost),
                  "to", rough(summary.final_cost), "cost", rough(graph_cost(solved)));
  for (const auto& anchor : solved.anchors) text += line_of("anchor", anchor.T_map_session);
  for (std::size_t i = 0; i < solved.nodes.size(); ++i) {
    text += line_of("node", solved.T_map_node(i));
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
          line_of("session", i, "moved", fixed(moved_m, 1),
                  deformation_is_plausible(problem.state, after, i, config.graph) ? "plausible"
                                                                                  : "implausible");
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
      text += join(size, "clique") + list_text(max_clique(graph, candidates, steps)) + "\n";
    }
  }
  check_expected("merge_cliques", text);
}
