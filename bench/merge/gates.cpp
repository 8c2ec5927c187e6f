// Figures of loop candidates of two runs at every gate of verification, beside the true poses: a
// line a candidate
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/lcm/received_log.hpp"
#include "src/merge/loop_search.hpp"
#include "src/merge/loop_verifier.hpp"
#include "src/merge/parallel.hpp"

using namespace unimapper;
using namespace unimapper::merge;
namespace fs = std::filesystem;

namespace {

/// T_world_scan of a recording, a pose a scan.
std::vector<Pose> true_poses(const fs::path& dataset) {
  const fs::path file = dataset / "gt_poses.txt";
  return datasets::parse_trajectory(datasets::read_file(file), file).poses;
}

/// T_world_keyframe: where the scan truly is, and the keyframe beside it.
Pose true_pose(const KeyframeRecord& keyframe, const std::vector<Pose>& T_world_scan) {
  const KeyframeScan& scan = keyframe.scans.at(keyframe.reference_scan);
  return T_world_scan.at(scan.scan_index) * scan.T_odometry_sensor.inverse() *
         keyframe.T_odometry_keyframe;
}

struct Verified {
  LoopConstraint loop;
  std::vector<LoopGate> gates;
};

void print_error(const Pose& estimate, const Pose& truth) {
  const Pose error = truth.inverse() * estimate;
  std::printf("%.3f %.4f", error.translation.norm(), rotation_angle(error.rotation));
}

/// Errors of the proposed and of the registered pose (metres, radians), then each gate.
void print(const LoopCandidate& candidate, const Verified& verified, const Pose& truth) {
  print_error(candidate.T_match_query, truth);
  std::printf(" ");
  print_error(verified.loop.T_match_query, truth);
  for (const LoopGate& gate : verified.gates) {
    std::printf("\t%s=%s %.3f", gate.name, gate.passed ? "passed" : "refused", gate.value);
  }
  std::printf("\n");
}

void print_all(const std::vector<SessionData>& sessions,
               const std::vector<std::vector<Pose>>& truths) {
  const MergeConfig config;
  KeyframeClouds clouds(sessions, config.registration, config.threads);
  const std::vector<LoopCandidate> candidates =
      find_inter_session_candidates(sessions, config.loops);
  std::vector<KeyframeId> needed;
  for (const LoopCandidate& candidate : candidates) {
    needed.push_back(candidate.query);
    needed.push_back(candidate.match);
  }
  clouds.prepare(std::move(needed));
  std::vector<Verified> verified(candidates.size());
  parallel_for(candidates.size(), config.threads, [&](std::size_t i) {
    verified[i].loop.T_match_query = candidates[i].T_match_query;
    verified[i].gates = ask_gates(candidates[i], descriptor_limit(config), clouds, config,
                                  GatesAsked::kAll, verified[i].loop);
  });
  const auto truth_of = [&](const KeyframeId& id) {
    return true_pose(sessions[id.session].keyframes[id.keyframe], truths[id.session]);
  };
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    print(candidates[i], verified[i],
          truth_of(candidates[i].match).inverse() * truth_of(candidates[i].query));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr,
                 "usage: merge_gates_bench KEYFRAMES.lcmlog DATASET KEYFRAMES.lcmlog DATASET\n");
    return 2;
  }
  try {
    std::vector<SessionData> sessions;
    std::vector<std::vector<Pose>> truths;
    for (const int i : {1, 3}) {
      auto received = lcm_port::read_event_log(argv[i]).sessions;
      if (received.size() != 1) throw std::runtime_error("each log must hold one session");
      sessions.push_back(std::move(received.front()));
      truths.push_back(true_poses(argv[i + 1]));
    }
    print_all(sessions, truths);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "merge_gates_bench: %s\n", error.what());
    return 1;
  }
  return 0;
}
