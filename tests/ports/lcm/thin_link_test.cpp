// Tests of thin links: summaries keep up with the robot, keyframes follow as the link allows.
#include "src/core/quantile.hpp"
#include "tests/ports/lcm/simulated_link.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::lcm_port;
using lcm_test::LinkModel;
using lcm_test::SimulatedLink;

namespace {

constexpr std::int64_t kSecond = 1000000000;

/// A summary of 128 keypoints in datagrams of 1,300 bytes.
constexpr std::uint32_t kLeading = 3;

/// Mapping for so many seconds, a keyframe of so many pieces each.
void drive(SimulatedLink& world, int seconds, std::uint32_t pieces) {
  for (int i = 0; i < seconds; ++i) {
    world.publish(pieces, kLeading);
    world.run(world.now_ns() + kSecond);
  }
}

/// How long the summaries took from keyframe `first` on, in seconds; those that never came as long
/// as the simulation went on.
std::vector<double> latencies_s(const SimulatedLink& world, std::size_t first) {
  std::vector<double> seconds;
  for (std::size_t i = first; i < world.keyframes.size(); ++i) {
    const auto& keyframe = world.keyframes[i];
    const std::int64_t end = keyframe.summary_ns.value_or(world.now_ns() + 1000 * kSecond);
    seconds.push_back(static_cast<double>(end - keyframe.published_ns) * 1e-9);
  }
  return seconds;
}

std::size_t whole(const SimulatedLink& world) {
  return static_cast<std::size_t>(
      std::count_if(world.keyframes.begin(), world.keyframes.end(),
                    [](const auto& keyframe) { return keyframe.whole_ns.has_value(); }));
}

}  // namespace

TEST_CASE("at 64 kbit/s a summary arrives within a second of its keyframe") {
  const auto seed = GENERATE(as<std::uint64_t>(), 1, 2, 3);
  const std::uint32_t pieces = GENERATE(80U, 200U);  // of a VLP-16, of an OS2-128
  SimulatedLink world({8000.0, 4000.0, 0, 10000000}, {4000.0, 20e6, 250e3}, true, seed);
  drive(world, 120, pieces);
  world.run(world.now_ns() + 2 * kSecond);
  // The first ones are sent too fast, before the rate is known.
  std::vector<double> seconds = latencies_s(world, 30);
  CAPTURE(seed, pieces, world.pacing.rate());
  CHECK(quantile(std::span(seconds), 0.9) < 1.0);
  CHECK(*std::max_element(seconds.begin(), seconds.end()) < 3.0);
}

TEST_CASE("at 256 kbit/s summaries keep up, and the rest of the link delivers whole keyframes") {
  const std::uint32_t loss_per_mille = GENERATE(0U, 50U);
  const double bottleneck = 32000.0;
  SimulatedLink world({bottleneck, 8000.0, loss_per_mille, 10000000}, {5200.0, 20e6, 250e3}, true);
  constexpr std::uint32_t kPieces = 200;
  drive(world, 300, kPieces);
  std::vector<double> seconds = latencies_s(world, 30);
  seconds.resize(seconds.size() - 5);  // of the last the simulation may not have seen the end
  CAPTURE(loss_per_mille, world.pacing.rate());
  CHECK(quantile(std::span(seconds), 0.5) < 0.5);
  CHECK(quantile(std::span(seconds), 0.9) < 2.0);
  // Summaries take an eighth of the link. Keyframes are sent one after the other: little of it goes
  // for pieces of keyframes that never become whole.
  const double share = static_cast<double>(whole(world)) * kPieces * SimulatedLink::kPieceBytes /
                       (300.0 * bottleneck);
  CHECK(share > 0.6);
}
