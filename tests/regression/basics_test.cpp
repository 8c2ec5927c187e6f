// Geometry and free columns on random input
#include "expected_text.hpp"
#include "src/core/nearest_rotation.hpp"
#include "src/core/pose_interpolation.hpp"
#include "src/core/quantile.hpp"
#include "src/core/rigid_fit.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "src/core/tilt_prior.hpp"
#include "src/free_space/free_columns.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"
#include "words.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

Eigen::Vector3d random_vector(test::Random& random, double extent) {
  Eigen::Vector3d v;
  for (int axis = 0; axis < 3; ++axis) v(axis) = random.uniform(-extent, extent);
  return v;
}

Pose random_pose(test::Random& random, double extent_m) {
  const Eigen::Vector3d axis = random_vector(random, 1.0);
  const Eigen::Quaterniond q(random.uniform(0.3, 1.0), axis.x(), axis.y(), axis.z());
  return {q, random_vector(random, extent_m)};
}

std::string matrix_text(const Eigen::Matrix3d& m, int digits = 4) {
  return vector_text(m.row(0), digits) + " / " + vector_text(m.row(1), digits) + " / " +
         vector_text(m.row(2), digits);
}

}  // namespace

TEST_CASE("fits, rotations and tilts of random frames, as before on every platform",
          "[regression]") {
  test::Random random(1);
  std::string text;
  for (int round = 0; round < 8; ++round) {
    const Pose T_b_a = random_pose(random, 30.0);
    std::vector<PointPair> pairs;
    std::vector<Eigen::Vector2f> a;
    std::vector<Eigen::Vector2f> b;
    for (int i = 0; i < 3 + 4 * round; ++i) {
      const Eigen::Vector3d p = random_vector(random, 10.0);
      const Eigen::Vector3d noise = random_vector(random, 0.1);
      pairs.push_back({p, T_b_a * p + noise});
      a.push_back(p.head<2>().cast<float>());
      const Eigen::Vector3d q = Eigen::Vector3d(-p.y(), p.x(), 0.0) + noise;
      b.push_back(q.head<2>().cast<float>());
    }
    Pose fitted;
    text += fit_rigid(pairs, fitted) ? "fitted " + pose_text(fitted) + "\n" : "not fitted\n";
    PlanarPose planar;
    const bool ok = fit_planar(a.data(), b.data(), static_cast<std::uint32_t>(a.size()), planar);
    const auto number = [](float value) { return fixed(value, 4); };
    text += line_of(ok ? "planar" : "not planar", number(planar.cosine), number(planar.sine),
                    number(planar.x), number(planar.y));
    const PlanarPose above = seen_from_above(T_b_a);
    const PlanarPose both = above * planar;
    text +=
        line_of("above", number(above.cosine), number(above.sine), number(above.x), number(above.y),
                "product", number(both.cosine), number(both.x), number(both.y));
    Eigen::Matrix3d distorted = T_b_a.rotation;
    for (int i = 0; i < 9; ++i) distorted.data()[i] += random.uniform(-0.4, 0.4);
    const NearestRotation nearest = nearest_rotation(distorted);
    text += line_of("rotation", matrix_text(nearest.rotation), fixed(nearest.deciding_value, 4));
    const Eigen::Matrix3d symmetric = distorted + distorted.transpose().eval();
    const SymmetricEigen<double> eigen = symmetric_eigen<double>(symmetric);
    text += line_of("eigen", vector_text(eigen.values, 4), matrix_text(eigen.vectors.cwiseAbs()));
    const Pose other = random_pose(random, 10.0);
    text += "between " + pose_text(interpolate(T_b_a, other, 0.3)) + "\n";
    const Eigen::Vector3d up =
        (Eigen::Vector3d::UnitZ() + 0.2 * random_vector(random, 1.0)).normalized();
    text += "level " + pose_text(level_frame(other, up)) + "\n";
    // Two frames that are nearly level.
    Pose leaning = other;
    leaning.rotation = level_frame(other, up).rotation;
    const KeyframeUp match{true, 3e-4F, 1e-4F, 8e-4F};
    const KeyframeUp query{round % 3 != 0, 5e-4F, -2e-4F, 2e-4F};
    const TiltPrior prior(match, query, leaning);
    Eigen::Matrix2d measured;
    measured << 3000.0, 800.0, 800.0, 1500.0;
    const Eigen::Vector2d tilt = tilt_of(leaning);
    text +=
        line_of("tilt", vector_text(tilt, 5), "information", fixed(prior.information()(0, 0), 1),
                fixed(prior.information()(0, 1), 1), fixed(prior.information()(1, 1), 1), "sigmas",
                fixed(prior.sigmas(tilt, measured), 4), fixed(prior.sigmas(tilt, 0.02), 4),
                "posterior", vector_text(prior.posterior(tilt, measured), 5));
    text += "tilted " + pose_text(with_tilt(leaning, {0.05, -0.03})) + "\n";
  }
  std::vector<double> values;
  for (int i = 0; i < 37; ++i) values.push_back(random.uniform(-5.0, 5.0));
  for (const double share : {0.0, 0.1, 0.25, 0.5, 0.95, 1.0}) {
    std::vector<double> copy = values;
    text += "quantile " + fixed(quantile(std::span(copy), share), 4) + "\n";
  }
  text += "median " + fixed(median(std::span(values)), 4) + "\n";
  check_expected("geometry", text);
}

TEST_CASE("free columns over random ground, as before on every platform", "[regression]") {
  test::Random random(3);
  std::string text;
  for (int round = 0; round < 4; ++round) {
    Owned<FreeColumns> columns(std::size_t{round == 3 ? 6U : 64U});
    std::map<std::uint64_t, std::pair<Block, std::uint64_t>> blocks;  // with the ground
    for (int i = 0; i < 900; ++i) {
      const auto x = static_cast<std::int32_t>(random.below(24)) - 9;
      const auto y = static_cast<std::int32_t>(random.below(24)) - 14;
      const auto z = static_cast<std::int32_t>(random.below(14)) - 6;
      const VoxelIndex cell{x, y, z};
      auto& [block, ground] = blocks[pack(block_of(cell))];
      block.index = block_of(cell);
      const std::uint64_t bit = std::uint64_t{1} << bit_of(cell);
      block.occupied |= bit;
      if (z < static_cast<std::int32_t>(random.below(4)) - 2) ground |= bit;
    }
    std::vector<Block> list;
    std::vector<std::uint64_t> ground;
    for (const auto& [key, entry] : blocks) {
      list.push_back(entry.first);
      ground.push_back(entry.second);
    }
    columns->build(list, [&](std::uint32_t b) { return ground[b]; });
    std::size_t free = 0;
    std::int64_t heights = 0;
    for (std::int32_t x = -14; x < 20; ++x) {
      for (std::int32_t y = -19; y < 15; ++y) {
        for (std::int32_t z = -9; z < 12; ++z) {
          if (!columns->is_free({x, y, z})) continue;
          ++free;
          heights += z;
        }
      }
    }
    text += line_of("free", free, "heights", heights, "left out", columns->left_out());
  }
  check_expected("free_columns", text);
}
