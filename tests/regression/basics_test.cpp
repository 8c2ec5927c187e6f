// Geometry and free space on random, tilted input
#include <catch2/catch.hpp>
#include <map>
#include <string>
#include <vector>

#include "expected_text.hpp"
#include "tests/random.hpp"
#include "unimapper/core/image_code.hpp"
#include "unimapper/core/nearest_rotation.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/core/pose_interpolation.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/core/rigid_fit.hpp"
#include "unimapper/core/symmetric_eigen.hpp"
#include "unimapper/core/tilt_prior.hpp"
#include "unimapper/free_space/free_columns.hpp"
#include "unimapper/free_space/inverse_sensor_model.hpp"
#include "unimapper/free_space/range_image.hpp"
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
    const auto number = [](float value) { return fixed(static_cast<double>(value), 4); };
    text += join(ok ? "planar" : "not planar", number(planar.cosine), number(planar.sine),
                 number(planar.x), number(planar.y)) +
            "\n";
    const PlanarPose above = seen_from_above(T_b_a);
    const PlanarPose both = above * planar;
    text += join("above", number(above.cosine), number(above.sine), number(above.x),
                 number(above.y), "product", number(both.cosine), number(both.x), number(both.y)) +
            "\n";
    Eigen::Matrix3d distorted = T_b_a.rotation;
    for (int i = 0; i < 9; ++i) distorted.data()[i] += random.uniform(-0.4, 0.4);
    const NearestRotation nearest = nearest_rotation(distorted);
    text +=
        join("rotation", matrix_text(nearest.rotation), fixed(nearest.deciding_value, 4)) + "\n";
    const Eigen::Matrix3d symmetric = distorted + distorted.transpose().eval();
    const SymmetricEigen<double> eigen = symmetric_eigen<double>(symmetric);
    text +=
        join("eigen", vector_text(eigen.values, 4), matrix_text(eigen.vectors.cwiseAbs())) + "\n";
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
    text += join("tilt", vector_text(tilt, 5), "information", fixed(prior.information()(0, 0), 1),
                 fixed(prior.information()(0, 1), 1), fixed(prior.information()(1, 1), 1), "sigmas",
                 fixed(prior.sigmas(tilt, measured), 4), fixed(prior.sigmas(tilt, 0.02), 4),
                 "posterior", vector_text(prior.posterior(tilt, measured), 5)) +
            "\n";
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

TEST_CASE("range images and what they tell of tilted points, as before on every platform",
          "[regression]") {
  test::Random random(2);
  std::string text;
  const RangeImageShape shapes[] = {{360.0F, 1.7F, -31.0F, 23.0F, 1.3F},
                                    {95.0F, 0.9F, -20.0F, 35.0F, 1.1F},
                                    {360.0F, 3.0F, -90.0F, 90.0F, 4.0F}};
  for (const RangeImageShape& shape : shapes) {
    for (const std::uint32_t min_returns : {1U, 4U}) {
      Owned<RangePainter> painter(RangePainterConfig{shape, 1.5F, 40.0F, min_returns, 5500, 0});
      std::vector<Eigen::Vector3f> points;
      for (int i = 0; i < 6000; ++i) {
        // A room with a pillar; some points are too near, too far or none.
        const Eigen::Vector3d d = random_vector(random, 1.0).normalized();
        double range =
            std::min({12.0 / std::abs(d.x()), 9.0 / std::abs(d.y()), 4.0 / std::abs(d.z())});
        if (d.x() > 0.9) range = 3.0;
        if (i % 50 == 7) range = 60.0;
        if (i % 50 == 8) range = 1.0;
        points.push_back((range * d).cast<float>());
      }
      const ImageProjection& projection = painter->projection();
      std::vector<std::uint16_t> pixels(projection.pixels());
      painter->paint(PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f)),
                     pixels.data());
      std::uint64_t known = 0;
      std::uint64_t sum = 0;
      std::uint64_t weighted = 0;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        known += pixels[i] == kNoRange ? 0 : 1;
        sum += pixels[i];
        weighted += (i % 251) * pixels[i];
      }
      std::vector<std::uint8_t> code(max_image_code(pixels.size()));
      code.resize(encode_image(pixels, code));
      std::vector<std::uint16_t> decoded(pixels.size());
      REQUIRE(decode_image(code, decoded));
      std::uint64_t rounded = 0;
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        CHECK(decoded[i] <= pixels[i]);
        rounded += decoded[i];
      }
      text += join("image", count(projection.columns()), count(projection.rows()),
                   projection.wraps() ? "wraps" : "ends", "known", count(known), "sum", count(sum),
                   count(weighted), "code", count(code.size()), checksum(code), "decoded",
                   count(rounded)) +
              "\n";
      // What it tells of points in a tilted frame.
      const Pose T_sensor_points = random_pose(random, 2.0);
      std::vector<float> x, y, z;
      for (int i = 0; i < 3000; ++i) {
        const Eigen::Vector3d p = random_vector(random, 11.0);
        x.push_back(static_cast<float>(p.x()));
        y.push_back(static_cast<float>(p.y()));
        z.push_back(static_cast<float>(p.z()));
      }
      for (const float full_weight_m : {0.0F, 5.0F}) {
        std::vector<std::int32_t> log_odds(x.size(), 3);
        const InverseSensorModel model(VisibilityTest(0.4F, 0.02F), EvidenceWeights{700, 400, 210},
                                       full_weight_m);
        model.add(
            pixels.data(), projection, T_sensor_points.rotation.cast<float>(),
            T_sensor_points.translation.cast<float>(),
            {x.data(), y.data(), z.data(), log_odds.data(), static_cast<std::uint32_t>(x.size())});
        std::map<std::string, std::size_t> kinds;
        std::int64_t total = 0;
        for (const std::int32_t value : log_odds) {
          ++kinds[value > 3 ? "free" : value < 3 ? "surface" : "unknown"];
          total += value;
        }
        text += join("  observed free", count(kinds["free"]), "surface", count(kinds["surface"]),
                     "unknown", count(kinds["unknown"]), "sum", count(total)) +
                "\n";
      }
    }
  }
  check_expected("range_images", text);
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
    text += join("free", count(free), "heights", count(heights), "left out",
                 count(columns->left_out())) +
            "\n";
  }
  check_expected("free_columns", text);
}
