// Outcome of a merge of two runs with every rule of acceptance and with single ones or sets of them
// switched off, and figures of their loop candidates, beside the true poses; lines for pairs.sh
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bench/merge/pair_picture.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/lcm/received_log.hpp"
#include "src/merge/loops/loop_search.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "src/merge/loops/radius_search.hpp"
#include "src/merge/parallel.hpp"
#include "src/merge/placements/placement_check.hpp"
#include "src/merge/placements/placement_walls.hpp"
#include "src/merge/sessions/seen_extent.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/keyframe_level.hpp"

using namespace unimapper;
using namespace unimapper::merge;
namespace fs = std::filesystem;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
// Keyframes of the query so near to one of the match say how far off a placement is; and so near
// the two sessions overlap.
constexpr double kNearM = 15.0;

/// T_world_keyframe by keyframe, of the poses of a recording's scans.
std::vector<Pose> true_poses(const SessionData& session, const fs::path& dataset) {
  const fs::path file = dataset / "gt_poses.txt";
  const std::vector<Pose> T_world_scan =
      datasets::parse_trajectory(datasets::read_file(file), file).poses;
  std::vector<Pose> poses;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    const KeyframeScan& scan = keyframe.scans.at(keyframe.reference_scan);
    poses.push_back(T_world_scan.at(scan.scan_index) * scan.T_odometry_sensor.inverse() *
                    keyframe.T_odometry_keyframe);
  }
  return poses;
}

/// Two runs, the match and the query.
struct Runs {
  std::vector<SessionData> sessions;
  std::vector<std::vector<Pose>> T_world_keyframe;  ///< true poses, by session

  [[nodiscard]] const Pose& truth(KeyframeId id) const {
    return T_world_keyframe[id.session][id.keyframe];
  }
};

Runs read_runs(const std::array<fs::path, 2>& logs, const std::array<fs::path, 2>& datasets) {
  Runs runs;
  for (std::size_t s = 0; s < 2; ++s) {
    auto received = lcm_port::read_event_log(logs[s]).sessions;
    if (received.size() != 1) throw std::runtime_error(logs[s].string() + ": not one session");
    (void)level_keyframes(received.front());
    runs.T_world_keyframe.push_back(true_poses(received.front(), datasets[s]));
    runs.sessions.push_back(std::move(received.front()));
  }
  return runs;
}

/// The keyframe of the match that is truly nearest to one of the query; the distance comes second.
std::pair<std::size_t, double> nearest_of_match(const Runs& runs, std::size_t query) {
  const Eigen::Vector3d at = runs.truth({1, query}).translation;
  std::pair<std::size_t, double> nearest{0, kNever};
  for (std::size_t k = 0; k < runs.T_world_keyframe[0].size(); ++k) {
    const double distance_m = (runs.truth({0, k}).translation - at).norm();
    if (distance_m < nearest.second) nearest = {k, distance_m};
  }
  return nearest;
}

/// Drops the query's first keyframes: no more than `overlap_m` of the way that is left lies beside
/// that of the match.
void shorten_overlap(Runs& runs, double overlap_m) {
  std::vector<Pose>& poses = runs.T_world_keyframe[1];
  std::size_t first = poses.size();
  double beside_m = 0.0;
  for (; first > 0 && beside_m <= overlap_m; --first) {
    if (first == poses.size() || nearest_of_match(runs, first - 1).second > kNearM) continue;
    beside_m += (poses[first].translation - poses[first - 1].translation).norm();
  }
  const auto count = static_cast<std::ptrdiff_t>(first);
  poses.erase(poses.begin(), poses.begin() + count);
  auto& keyframes = runs.sessions[1].keyframes;
  keyframes.erase(keyframes.begin(), keyframes.begin() + count);
}

struct Verified {
  LoopCandidate candidate;
  LoopConstraint loop;
  std::vector<LoopGate> gates;
};

std::vector<Verified> ask_all_gates(const Runs& runs, KeyframeClouds& clouds,
                                    const MergeConfig& config) {
  std::vector<KeyframeId> needed;
  std::vector<Verified> verified;
  for (const LoopCandidate& candidate :
       find_inter_session_candidates(runs.sessions, config.loops)) {
    needed.push_back(candidate.query);
    needed.push_back(candidate.match);
    verified.push_back({candidate, {}, {}});
  }
  clouds.prepare(std::move(needed));
  parallel_for(verified.size(), config.threads, [&](std::size_t i) {
    auto& [candidate, loop, gates] = verified[i];
    loop.query = candidate.query;
    loop.match = candidate.match;
    loop.T_match_query = candidate.T_match_query;
    loop.confidence = candidate.confidence;
    loop.decision.accepted = true;
    gates = ask_gates(candidate, kDescriptorLimit, clouds, config, GatesAsked::kAll, loop);
  });
  return verified;
}

void print_error(const Pose& estimate, const Pose& truth) {
  const Pose error = truth.inverse() * estimate;
  std::printf("%.3f %.4f", error.translation.norm(), rotation_angle(error.rotation));
}

/// "candidate", errors of the proposed and of the registered pose (metres, radians), each gate.
void print(const Runs& runs, const Verified& verified) {
  const Pose truth =
      runs.truth(verified.candidate.match).inverse() * runs.truth(verified.candidate.query);
  std::printf("candidate\t");
  print_error(verified.candidate.T_match_query, truth);
  std::printf(" ");
  print_error(verified.loop.T_match_query, truth);
  for (const LoopGate& gate : verified.gates) {
    std::printf("\t%s=%s %.3f", gate.name, gate.passed ? "passed" : "refused", gate.value);
  }
  std::printf("\n");
}

/// A rule of acceptance, and how it is switched off.
struct Rule {
  const char* name = "";
  std::vector<std::string_view> gates;  ///< of single loops
  void (*switch_off)(MergeConfig&) = [](MergeConfig&) {};
  bool is_vote = false;   ///< votes of neighbours against a placement
  bool is_walls = false;  ///< walls that do not fit
};

const std::vector<Rule>& rules() {
  static const std::vector<Rule> all = {
      {"none", {}},
      {"tilt", {"tilt in sigmas"}},
      {"overlap before", {"overlap before alignment"}},
      {"convergence", {"alignment did not converge"}},
      {"correction", {"alignment moved it by metres", "alignment turned it by radians"}},
      {"overlap", {"overlap"}},
      {"free space", {"structure in free space"}},
      {"number and span",
       {},
       [](MergeConfig& config) {
         config.acceptance.min_loops = config.acceptance.min_strong_loops = 2;
         config.acceptance.min_span_m = 0.0;
       }},
      {"competing set",
       {},
       [](MergeConfig& config) {
         config.acceptance.margin = config.acceptance.sufficient_margin = 1.0;
       }},
      {"weakest direction", {}, [](MergeConfig& config) { config.acceptance.vote_sigma_m = 1e6; }},
      {"one place", {}, [](MergeConfig& config) { config.acceptance.place_span_m = 0.0; }},
      {"repetition", {}, [](MergeConfig& config) { config.aliasing.alike_share = kNever; }},
      {"storeys", {}, [](MergeConfig& config) { config.aliasing.changed_share = kNever; }},
      {"votes of neighbours", {}, [](MergeConfig&) {}, true},
      {"walls", {}, [](MergeConfig&) {}, false, true},
      {"deformation", {}, [](MergeConfig& config) { config.graph.deformation_floor_m = 1e6; }},
  };
  return all;
}

/// Rules that are off together, by their names with + between them.
std::vector<const Rule*> rules_of(std::string_view names) {
  std::vector<const Rule*> found;
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find('+'));
    names.remove_prefix(std::min(names.size(), name.size() + 1));
    const auto rule = std::find_if(rules().begin(), rules().end(),
                                   [&](const Rule& one) { return one.name == name; });
    if (rule == rules().end()) throw std::runtime_error(std::string(name) + ": no rule");
    found.push_back(&*rule);
  }
  return found;
}

bool passes(const Verified& verified, const std::vector<const Rule*>& without) {
  return std::all_of(verified.gates.begin(), verified.gates.end(), [&](const LoopGate& gate) {
    return gate.passed || std::any_of(without.begin(), without.end(), [&](const Rule* rule) {
             return std::find(rule->gates.begin(), rule->gates.end(), gate.name) !=
                    rule->gates.end();
           });
  });
}

/// What a merge of two runs comes to, rule by rule; what the sensor data say is asked once.
class Acceptance {
 public:
  Acceptance(const Runs& runs, KeyframeClouds& clouds, const MergeConfig& config,
             const std::vector<Verified>& verified, fs::path picture)
      : runs_(runs),
        clouds_(clouds),
        config_(config),
        verified_(verified),
        picture_(std::move(picture)) {
    within_ =
        verify_loops(find_intra_session_candidates(runs.sessions, config.loops, config.threads),
                     kDescriptorLimit, clouds, config);
    std::erase_if(within_, [](const LoopConstraint& loop) { return !loop.decision.accepted; });
    for (const SessionData& session : runs.sessions) {
      AlignmentSession& aligned = sessions_.emplace_back();
      aligned.extent_m = seen_extent_m(session);
      for (const KeyframeRecord& keyframe : session.keyframes) {
        aligned.T_odometry_keyframe.push_back(keyframe.T_odometry_keyframe);
      }
    }
  }

  /// "rule", the names, the outcome of the pair and the error of the placement, metres; "-": no
  /// keyframes lie beside each other. With all rules the poses are refined, and drawn.
  void print_without(const std::string& names) {
    const std::vector<const Rule*> without = rules_of(names);
    MergeConfig config = config_;
    for (const Rule* rule : without) rule->switch_off(config);
    std::vector<LoopConstraint> loops = within_;
    for (const Verified& verified : verified_) {
      if (passes(verified, without)) loops.push_back(verified.loop);
    }
    Alignment alignment = align_sessions(sessions_, loops, config, [&](const Placement& placement) {
      PlacementEvidence evidence = evidence_of(placement, config);
      for (const Rule* rule : without) {
        if (rule->is_vote) evidence.contradicting = 0;
        if (rule->is_walls && evidence.aliasing.starts_with("the walls")) evidence.aliasing.clear();
      }
      return evidence;
    });
    const bool is_merged = alignment.connected[0] && alignment.connected[1];
    const bool has_all_rules = names == rules().front().name;
    if (is_merged && has_all_rules) alignment = refined(alignment, loops);
    std::string state = alignment.pairs.empty() ? "refused" : state_name(alignment.pairs[0].state);
    if (is_merged) state = "merged";
    const Pose T_match_query =
        is_merged ? alignment.T_map_session[0].inverse() * alignment.T_map_session[1]
        : alignment.pairs.empty() ? Pose{}
                                  : alignment.pairs[0].T_match_session_query_session;
    if (has_all_rules && !picture_.empty()) draw(alignment, T_match_query, state == "refused");
    std::printf("rule\t%s\t%s\t%s\t%s\n", names.c_str(), state.c_str(),
                state == "refused" ? "-" : error_text(alignment, T_match_query).c_str(),
                alignment.pairs.empty() ? "no loops" : alignment.pairs[0].reason.c_str());
  }

 private:
  /// The placement that was found; the true one where there is none.
  void draw(const Alignment& alignment, const Pose& T_match_query, bool is_refused) const {
    std::array<std::vector<Pose>, 2> poses = {runs_.T_world_keyframe[0], runs_.T_world_keyframe[1]};
    if (!is_refused) {
      poses = {alignment.T_session_keyframe[0], alignment.T_session_keyframe[1]};
      for (Pose& pose : poses[1]) pose = T_match_query * pose;
    }
    bench::write_pair_picture(runs_.sessions, poses, picture_);
  }

  Alignment refined(const Alignment& alignment, std::vector<LoopConstraint>& loops) {
    std::vector<LoopConstraint> known;
    for (std::size_t i = 0; i < loops.size(); ++i) {
      if (alignment.decisions[i].accepted) known.push_back(loops[i]);
    }
    for (LoopConstraint& loop :
         verify_loops(find_radius_candidates(runs_.sessions, alignment, known, config_),
                      kRadiusLimit, clouds_, config_)) {
      if (loop.decision.accepted) loops.push_back(std::move(loop));
    }
    return refine_alignment(alignment, sessions_, loops, config_);
  }

  PlacementEvidence evidence_of(const Placement& placement, const MergeConfig& config) {
    const Eigen::Vector3d& t = placement.T_match_session_query_session.translation;
    const EvidenceKey key{placement.loops.size(),
                          t.x(),
                          t.y(),
                          t.z(),
                          placement.competing.size(),
                          placement.is_short,
                          config.aliasing.alike_share,
                          config.aliasing.changed_share};
    const auto known = evidence_.find(key);
    if (known != evidence_.end()) return known->second;
    const PlacementEvidence evidence =
        PlacementEvaluator(runs_.sessions, clouds_, config).evaluate(placement);
    const PlacementWalls walls = compare_walls(placement, clouds_, config.threads);
    std::printf("walls\t%.3f\t%.3f\n", walls.between_m, walls.within_m);
    return evidence_.emplace(key, evidence).first->second;
  }

  /// Root mean square over the query's keyframes near the match, each seen from the nearest.
  [[nodiscard]] std::string error_text(const Alignment& alignment,
                                       const Pose& T_match_query) const {
    double squares = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < runs_.T_world_keyframe[1].size(); ++k) {
      const auto [nearest, distance_m] = nearest_of_match(runs_, k);
      if (distance_m > kNearM) continue;
      const Pose truth = runs_.truth({0, nearest}).inverse() * runs_.truth({1, k});
      const Pose found = alignment.T_session_keyframe[0][nearest].inverse() * T_match_query *
                         alignment.T_session_keyframe[1][k];
      squares += (found.translation - truth.translation).squaredNorm();
      ++count;
    }
    if (count == 0) return "-";
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", std::sqrt(squares / static_cast<double>(count)));
    return text;
  }

  const Runs& runs_;
  KeyframeClouds& clouds_;
  const MergeConfig& config_;
  const std::vector<Verified>& verified_;
  const fs::path picture_;
  std::vector<LoopConstraint> within_;
  std::vector<AlignmentSession> sessions_;
  /// Of a placement, and the parameters that rules switch off.
  using EvidenceKey =
      std::tuple<std::size_t, double, double, double, std::size_t, bool, double, double>;
  std::map<EvidenceKey, PlacementEvidence> evidence_;
};

double number_of(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw std::runtime_error(std::string(text) + ": not a number");
  }
  return value;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "usage: merge_pairs_bench MATCH.lcmlog DATASET QUERY.lcmlog DATASET\n"
                 "                         [OVERLAP [PICTURE [RULES...]]]\n"
                 "OVERLAP: way that the query has beside the match at most, metres, or all\n"
                 "PICTURE: a PNG of the placement that was found, or of the true one\n"
                 "RULES: names with + between them: off together; else each rule is off once\n");
    return 2;
  }
  try {
    Runs runs = read_runs({argv[1], argv[3]}, {argv[2], argv[4]});
    if (argc > 5 && argv[5] != std::string_view("all")) shorten_overlap(runs, number_of(argv[5]));
    const MergeConfig config;
    KeyframeClouds clouds(runs.sessions, config.registration, config.threads);
    const std::vector<Verified> verified = ask_all_gates(runs, clouds, config);
    for (const Verified& one : verified) print(runs, one);
    Acceptance acceptance(runs, clouds, config, verified, argc > 6 ? argv[6] : "");
    acceptance.print_without(rules().front().name);
    for (int i = 7; i < argc; ++i) acceptance.print_without(argv[i]);
    for (std::size_t i = 1; argc <= 7 && i < rules().size(); ++i) {
      acceptance.print_without(rules()[i].name);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "merge_pairs_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
