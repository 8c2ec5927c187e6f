// Processor time and error of the alignment of many sessions that drive through one city
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/merge/ambiguous_scene.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

struct Options {
  std::size_t sessions = 10;
  std::size_t keyframes = 500;
  std::uint64_t seed = 1;
  double drift = 1.0;          ///< times that of `odometry`
  double assumed_drift = 1.0;  ///< times the noise of the configuration
  std::string shape = "grid";
  double wrong_share = 0.1;    ///< loops anywhere, of all
  double shifted_share = 0.0;  ///< pairs of sessions whose loops lie as if one were moved, of all
};

constexpr int kStepsPerBlock = 20;
constexpr int kDistrictBlocks = 4;

/// Keyframes along streets 100 m apart, turning at crossings, within the district of a session.
std::vector<Pose> drive_streets(Random& random, std::size_t count, int x0, int y0) {
  int x = 0;
  int y = 0;
  int heading = static_cast<int>(random.below(4));
  constexpr int kDx[] = {1, 0, -1, 0};
  constexpr int kDy[] = {0, 1, 0, -1};
  const auto leads_out = [&](int h) {
    const int nx = x + kDx[h] * kStepsPerBlock;
    const int ny = y + kDy[h] * kStepsPerBlock;
    const int end = kDistrictBlocks * kStepsPerBlock;
    return nx < 0 || ny < 0 || nx > end || ny > end;
  };
  std::vector<Pose> path;
  while (path.size() < count) {
    const int back = (heading + 2) % 4;
    do heading = static_cast<int>(random.below(4));
    while (heading == back || leads_out(heading));
    for (int i = 0; i < kStepsPerBlock && path.size() < count; ++i) {
      path.push_back(yaw_pose(1.5707963 * heading, {kStepM * (x0 + x), kStepM * (y0 + y), 0.0}));
      x += kDx[heading];
      y += kDy[heading];
    }
  }
  return path;
}

/// Where a session's district begins, in steps. Districts overlap by half with their neighbours.
std::pair<int, int> district(const Options& options, std::size_t session) {
  const int size = kDistrictBlocks * kStepsPerBlock / 2;
  const auto s = static_cast<int>(session);
  if (options.shape == "chain") return {s * size, 0};
  if (options.shape == "star") return {0, 0};
  if (options.shape == "groups") return {s / 2 * size, s % 2 * 100 * size};
  const auto columns =
      static_cast<int>(std::ceil(std::sqrt(static_cast<double>(options.sessions))));
  return {s % columns * size, s / columns * size};
}

/// Up to a dozen loops for each pair of sessions that share streets, then wrong ones.
void add_loops(Scene& scene, const Options& options, Random& random) {
  std::map<std::pair<long, long>, std::vector<KeyframeId>> places;
  for (std::size_t s = 0; s < scene.truth.size(); ++s) {
    for (std::size_t k = 0; k < scene.truth[s].size(); ++k) {
      const Eigen::Vector3d& p = scene.truth[s][k].translation;
      places[{std::lround(p.x() / kStepM), std::lround(p.y() / kStepM)}].push_back({s, k});
    }
  }
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::pair<KeyframeId, KeyframeId>>>
      shared;
  for (const auto& [place, keyframes] : places) {
    for (const KeyframeId& match : keyframes) {
      for (const KeyframeId& query : keyframes) {
        if (match.session < query.session) {
          shared[{match.session, query.session}].push_back({query, match});
        }
      }
    }
  }
  constexpr std::size_t kLoopsPerPair = 12;
  constexpr double kShiftM = 10.0;
  for (const auto& [sessions, pairs] : shared) {
    const std::size_t count = std::min(kLoopsPerPair, pairs.size());
    Pose shift;  // in the frame of the truth, one for all loops of the pair
    if (options.shifted_share > 0.0 && random.uniform() < options.shifted_share) {
      shift.translation = random.normal3(1.0).normalized() * kShiftM;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [query, match] = pairs[i * pairs.size() / count];
      const Pose T_match_query = scene.truth[match.session][match.keyframe].inverse() * shift *
                                 scene.truth[query.session][query.keyframe];
      loop(scene, query, match, T_match_query, random);
    }
  }
  const auto wrong =
      static_cast<std::size_t>(options.wrong_share * static_cast<double>(scene.loops.size()));
  for (std::size_t i = 0; i < wrong; ++i) {
    const std::size_t match = random.below(options.sessions);
    const std::size_t query = random.below(options.sessions);
    if (match >= query) continue;
    loop(scene, {query, random.below(options.keyframes)}, {match, random.below(options.keyframes)},
         yaw_pose(random.uniform(-3.1, 3.1), random.normal3(2.0)), random);
  }
}

/// Of all connected keyframes after one rigid alignment, metres.
double ate_m(const Scene& scene, const Alignment& alignment) {
  std::vector<Pose> truth;
  std::vector<Pose> estimate;
  for (std::size_t s = 0; s < scene.truth.size(); ++s) {
    if (!alignment.connected[s]) continue;
    truth.insert(truth.end(), scene.truth[s].begin(), scene.truth[s].end());
    for (std::size_t k = 0; k < scene.truth[s].size(); ++k) {
      estimate.push_back(alignment.T_map_keyframe({s, k}));
    }
  }
  return trajectory_error_m(truth, estimate);
}

bool is_true(const Scene& scene, const LoopConstraint& l) {
  const Pose T = scene.truth[l.match.session][l.match.keyframe].inverse() *
                 scene.truth[l.query.session][l.query.keyframe];
  return apart_m(T, l.T_match_query) < 3.0;
}

void measure(const Options& options) {
  Random random{options.seed};
  Scene scene;
  for (std::size_t s = 0; s < options.sessions; ++s) {
    const auto [x, y] = district(options, s);
    scene.truth.push_back(drive_streets(random, options.keyframes, x, y));
    scene.sessions.push_back({odometry(random, scene.truth.back(), options.drift), 1.0});
  }
  add_loops(scene, options, random);
  MergeConfig config;
  config.odometry.translation_m_per_sqrt_m *= options.assumed_drift;
  config.odometry.rotation_rad_per_sqrt_m *= options.assumed_drift;
  const std::clock_t start = std::clock();
  const Alignment alignment = align(scene, config);
  const double processor_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::size_t right = 0;
  std::size_t accepted_right = 0;
  std::size_t accepted_wrong = 0;
  for (std::size_t i = 0; i < scene.loops.size(); ++i) {
    const bool is_right = is_true(scene, scene.loops[i]);
    right += is_right ? 1 : 0;
    if (!alignment.decisions[i].accepted) continue;
    ++(is_right ? accepted_right : accepted_wrong);
  }
  std::printf("%zu | %zu | %.1f | %td | %.2f | %.1f | %zu\n", options.sessions, scene.loops.size(),
              processor_s, std::count(alignment.connected.begin(), alignment.connected.end(), true),
              ate_m(scene, alignment),
              100.0 * static_cast<double>(accepted_right) / static_cast<double>(right),
              accepted_wrong);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Time and error of the alignment of many sessions"};
  Options options;
  app.add_option("--sessions", options.sessions);
  app.add_option("--keyframes", options.keyframes, "Of each session");
  app.add_option("--seed", options.seed);
  app.add_option("--drift", options.drift, "Of odometry, times the usual");
  app.add_option("--assumed-drift", options.assumed_drift, "Noise of the configuration, times");
  app.add_option("--wrong", options.wrong_share, "Share of loops that are anywhere");
  app.add_option("--shifted", options.shifted_share,
                 "Share of pairs of sessions whose loops are all shifted by ten metres");
  app.add_option("--shape", options.shape, "grid, chain, star or groups: which sessions meet");
  CLI11_PARSE(app, argc, argv);
  measure(options);
  return 0;
}
