// Acceptance and alignment of loops that are partly false: right, provisional, refused and wrong
#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "tests/merge/ambiguous_scene.hpp"
#include "unimapper/merge/alignment.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

/// What a trial of two sessions is made of.
struct Case {
  const char* name;
  std::size_t true_loops, random_loops, aliased_loops, shifted_loops;
};

constexpr Case kCases[] = {
    {"10 true", 10, 0, 0, 0},
    {"5 true", 5, 0, 0, 0},
    {"10 true + 10 random", 10, 10, 0, 0},
    {"5 true + 20 random", 5, 20, 0, 0},
    {"5 true + 100 random", 5, 100, 0, 0},
    {"no overlap, 60 random", 0, 60, 0, 0},
    {"no overlap, 200 random", 0, 200, 0, 0},
    {"no overlap, 10 aliased", 0, 0, 10, 0},
    {"10 true + 10 aliased", 10, 0, 10, 0},
    {"10 true + 15 aliased", 10, 0, 15, 0},
    {"10 true + 25 aliased", 10, 0, 25, 0},
    {"5 true + 12 aliased", 5, 0, 12, 0},
    {"3 true + 8 aliased", 3, 0, 8, 0},
    {"10 true + 10 shifted 3 m up", 10, 0, 0, 10},
    {"5 true + 12 shifted 3 m up", 5, 0, 0, 12},
};

/// The noise of the loops, standard deviation, metres and radians.
constexpr std::array<std::array<double, 2>, 2> kNoises{
    {{kLoopSigmaM, kLoopSigmaRad}, {0.1, kLoopSigmaRad / 3.0}}};
constexpr double kRightWithinM = 1.0;

/// A number of trials by what became of their maps.
struct Tally {
  std::size_t right = 0, provisional = 0, refused = 0, wrong = 0;

  /// `error_m` is the error of what overlaps; of what does not, infinite.
  void add(const Alignment& alignment, double error_m) {
    if (!alignment.connected[0] || !alignment.connected[1]) {
      ++(alignment.pairs.front().state == PairState::kProvisional ? provisional : refused);
    } else {
      ++(error_m <= kRightWithinM ? right : wrong);
    }
  }
  void print() const {
    std::printf(" %zu / %zu / %zu / %zu |", right, provisional, refused, wrong);
  }
};

Random random_of(std::uint64_t seed, std::size_t trial) { return Random(100'000 * seed + trial); }

Tally run(const Case& what, const std::array<double, 2>& noise, std::size_t trials,
          std::uint64_t seed) {
  Tally tally;
  for (std::size_t trial = 0; trial < trials; ++trial) {
    Random random = random_of(seed, trial);
    Scene scene = two_maps(random);
    scene.loop_sigma_m = noise[0];
    scene.loop_sigma_rad = noise[1];
    add_true_loops(scene, what.true_loops, random);
    add_random_loops(scene, what.random_loops, random);
    if (what.aliased_loops > 0) add_aliased_loops(scene, what.aliased_loops, random);
    add_true_loops(scene, what.shifted_loops, random, {0.0, 0.0, 3.0});
    const Alignment alignment = align(scene);
    tally.add(alignment, what.true_loops > 0 ? overlap_error_m(scene, alignment)
                                             : std::numeric_limits<double>::infinity());
  }
  return tally;
}

void print_pairs(std::size_t trials, std::uint64_t seed) {
  std::printf(
      "| two sessions, %zu trials: right / provisional / refused / wrong | noise 0.3 m | 0.1 m |\n",
      trials);
  std::printf("|---|---|---|\n");
  for (const Case& what : kCases) {
    std::printf("| %s |", what.name);
    for (const auto& noise : kNoises) run(what, noise, trials, seed).print();
    std::printf("\n");
    std::fflush(stdout);
  }
}

/// Loops of a tunnel between its portals, wrong along the bore.
struct Bore {
  const char* name;
  double common_m, scatter_m, along_m;
};

constexpr Bore kBores[] = {
    {"up to 3 m either way, claimed 0.3 m", 0.0, 3.0, 0.3},
    {"2.5 m all alike, claimed 0.3 m", 2.5, 0.0, 0.3},
    {"up to 3 m either way, claimed 3 m", 0.0, 3.0, 3.0},
    {"2.5 m all alike, claimed 3 m", 2.5, 0.0, 3.0},
    {"25 m all alike, claimed 0.3 m", 25.0, 0.0, 0.3},
};

void print_bores(std::size_t trials, std::uint64_t seed) {
  std::printf(
      "| tunnel, 6 true loops at the portals, 30 between them wrong along the bore | right / "
      "provisional / refused / wrong of %zu |\n|---|---|\n",
      trials);
  for (const Bore& bore : kBores) {
    Tally tally;
    for (std::size_t trial = 0; trial < trials; ++trial) {
      Random random = random_of(seed, trial);
      Scene scene = tunnel(random);
      add_tunnel_loops(scene, bore.common_m, bore.scatter_m, bore.along_m, random);
      const Alignment alignment = align(scene);
      tally.add(alignment, side_by_side_error_m(scene, alignment));
    }
    std::printf("| %s |", bore.name);
    tally.print();
    std::printf("\n");
    std::fflush(stdout);
  }
}

/// Laps with a false intra-session loop: how often it is accepted, and the mean trajectory errors.
struct Laps {
  std::size_t accepted = 0;
  double before_m = 0.0, after_m = 0.0;
};

Laps run_laps(double odometry_scale, std::size_t true_loops, std::size_t trials,
              std::uint64_t seed) {
  Laps laps;
  for (std::size_t trial = 0; trial < trials; ++trial) {
    Random random = random_of(seed, trial);
    Scene scene = lap(random, odometry_scale);
    add_false_intra_loop(scene, random);
    add_true_intra_loops(scene, true_loops, random);
    const Alignment alignment = align(scene);
    if (alignment.decisions.front().accepted) ++laps.accepted;
    const double share = 1.0 / static_cast<double>(trials);
    laps.before_m +=
        share * trajectory_error_m(scene.truth[0], scene.sessions[0].T_odometry_keyframe);
    laps.after_m += share * trajectory_error_m(scene.truth[0], alignment.T_session_keyframe[0]);
  }
  return laps;
}

void print_laps(std::size_t trials, std::uint64_t seed) {
  struct Row {
    const char* name;
    double odometry_scale;
    std::size_t true_loops;
  };
  constexpr Row kRows[] = {{"odometry as modelled", 1.0, 0},
                           {"odometry five times better", 0.2, 0},
                           {"odometry as modelled, four true loops beside it", 1.0, 4}};
  std::printf(
      "| one false intra-session loop, 10 m off, on a lap of 800 m; %zu trials | accepted "
      "| ATE before, m | ATE after, m |\n|---|---|---|---|\n",
      trials);
  for (const Row& row : kRows) {
    const Laps laps = run_laps(row.odometry_scale, row.true_loops, trials, seed);
    std::printf("| %s | %zu | %.2f | %.2f |\n", row.name, laps.accepted, laps.before_m,
                laps.after_m);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Merges of sessions whose loops are partly false: tables in Markdown");
  std::string table = "pairs";
  std::size_t trials = 30;
  std::uint64_t seed = 1;
  app.add_option("TABLE", table, "pairs, bores or laps")
      ->check(CLI::IsMember({"pairs", "bores", "laps"}))
      ->capture_default_str();
  app.add_option("TRIALS", trials, "Trials of every row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("SEED", seed, "Of all trials")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (table == "pairs") {
    print_pairs(trials, seed);
  } else if (table == "bores") {
    print_bores(trials, seed);
  } else {
    print_laps(trials, seed);
  }
  return 0;
}
