// Simulated town with scans of the same bits on every machine: whole millimetres, whole-number
// arithmetic, and no floating-point operation but single ones that IEEE 754 rounds exactly.
#pragma once

#include "tests/test.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::test {

/// One scan with its pose.
struct TownScan {
  std::vector<float> xyz;  ///< sensor frame, metres
  Pose T_odometry_sensor;
  [[nodiscard]] PointView view() const {
    return PointView::xyz(xyz.data(), xyz.size() / 3, 3 * sizeof(float));
  }
};

/// Flat ground, blocks that stand and blocks that walk across the robot's way. The robot drives out
/// and comes back, swinging its heading and nodding. Surfaces are sampled at random, those behind
/// others too: nothing here is a ray.
class IntegerTown {
 public:
  struct Options {
    std::uint64_t seed = 1;
    std::uint32_t ground_points = 6000;
    std::uint32_t points_per_block = 350;
    std::int64_t range_mm = 55000;
    bool only_ahead = false;  ///< a field of view of 70 degrees instead of all around
  };

  explicit IntegerTown(const Options& options) : options_(options) {
    constexpr int kBlocks = 44;
    Random random{options.seed};
    while (blocks_.size() < kBlocks) {
      Block block{};
      block.x = random.within(-45000, 60000);
      block.y = random.within(-40000, 40000);
      // Every third is a post, the others are walls and houses.
      const bool post = blocks_.size() % 3 == 0;
      block.half_x = post ? random.within(100, 300) : random.within(500, 5000);
      block.half_y = post ? random.within(100, 300) : random.within(300, 3000);
      block.height = random.within(1500, 8000);
      if (std::abs(block.y) > block.half_y + 5000) blocks_.push_back(block);
    }
  }

  /// What the robot sees at scan `index`, ten a second.
  [[nodiscard]] TownScan scan(std::int64_t index) const {
    const Robot robot = robot_at(index);
    TownScan scan;
    scan.T_odometry_sensor = robot.pose();
    Random random{options_.seed * 1000003U + static_cast<std::uint64_t>(index)};
    for (std::uint32_t i = 0; i < options_.ground_points; ++i) {
      // Denser near the robot, as rings are.
      const std::int64_t u = random.within(-1000, 1000);
      const std::int64_t v = random.within(-1000, 1000);
      add(robot, robot.x + u * std::abs(u) / 25, robot.y + v * std::abs(v) / 25,
          random.within(-15, 15), scan);
    }
    for (const Block& block : blocks_) add(robot, block, options_.points_per_block, random, scan);
    for (std::int64_t i = 0; i < kWalkers; ++i) {
      add(robot, walker_at(i, index), options_.points_per_block / 2, random, scan);
    }
    return scan;
  }

 private:
  static constexpr std::int64_t kWalkers = 5;
  static constexpr std::int64_t kSensorHeight = 1800;

  /// splitmix64.
  struct Random {
    std::uint64_t state;
    std::uint64_t next() {
      state += 0x9E3779B97F4A7C15ULL;
      std::uint64_t z = state;
      z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
      z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
      return z ^ (z >> 31U);
    }
    std::int64_t within(std::int64_t low, std::int64_t high) {
      return low + static_cast<std::int64_t>((next() >> 33U) %
                                             static_cast<std::uint64_t>(high - low + 1));
    }
  };

  /// A turn whose cosine and sine are fractions: by the half angle whose tangent is b / 1000.
  struct Turn {
    explicit Turn(std::int64_t b)
        : cosine(1000000 - b * b), sine(2000 * b), denominator(1000000 + b * b) {}
    std::int64_t cosine, sine, denominator;
    [[nodiscard]] double c() const { return ratio(cosine); }
    [[nodiscard]] double s() const { return ratio(sine); }

   private:
    [[nodiscard]] double ratio(std::int64_t part) const {
      return static_cast<double>(part) / static_cast<double>(denominator);
    }
  };

  struct Robot {
    std::int64_t x, y;
    Turn yaw, pitch;
    /// T_odometry_sensor; yaw first, then pitch.
    [[nodiscard]] Pose pose() const {
      Pose pose;
      pose.rotation << yaw.c() * pitch.c(), -yaw.s(), yaw.c() * pitch.s(),  //
          yaw.s() * pitch.c(), yaw.c(), yaw.s() * pitch.s(),                //
          -pitch.s(), 0.0, pitch.c();
      pose.translation << metres(x), metres(y), metres(kSensorHeight);
      return pose;
    }
    static double metres(std::int64_t mm) { return static_cast<double>(mm) / 1000.0; }
  };

  /// An upright block on the ground.
  struct Block {
    std::int64_t x, y, half_x, half_y, height;
  };

  /// Rises from 0 to `top` and falls again, one step per `index`.
  static std::int64_t there_and_back(std::int64_t index, std::int64_t top) {
    const std::int64_t phase = index % (2 * top);
    return phase < top ? phase : 2 * top - phase;
  }

  static Robot robot_at(std::int64_t index) {
    return {300 * there_and_back(index, 25), 20 * there_and_back(index, 40),
            Turn(6 * there_and_back(index + 20, 30) - 90), Turn(there_and_back(index, 7) - 3)};
  }

  /// Walks to and fro across the robot's way.
  static Block walker_at(std::int64_t walker, std::int64_t index) {
    const std::int64_t step = 110 + 15 * walker;
    return {9000 + 3500 * walker, step * there_and_back(index + 17 * walker, 45) - 3000, 250, 250,
            1750};
  }

  void add(const Robot& robot, const Block& block, std::uint32_t points, Random& random,
           TownScan& scan) const {
    for (std::uint32_t i = 0; i < points; ++i) {
      const std::int64_t side = random.within(0, 3);
      const std::int64_t along_x = random.within(-block.half_x, block.half_x);
      const std::int64_t along_y = random.within(-block.half_y, block.half_y);
      const std::int64_t noise = random.within(-10, 10);
      const std::int64_t x = side == 0   ? block.half_x + noise
                             : side == 1 ? -block.half_x + noise
                                         : along_x;
      const std::int64_t y = side == 2   ? block.half_y + noise
                             : side == 3 ? -block.half_y + noise
                                         : along_y;
      add(robot, block.x + x, block.y + y, random.within(0, block.height), scan);
    }
  }

  /// Takes a point of the town into the sensor's frame, if it is in sight.
  void add(const Robot& robot, std::int64_t x, std::int64_t y, std::int64_t z,
           TownScan& scan) const {
    const std::int64_t dx = x - robot.x;
    const std::int64_t dy = y - robot.y;
    const std::int64_t dz = z - kSensorHeight;
    if (dx * dx + dy * dy > options_.range_mm * options_.range_mm) return;
    const Turn& a = robot.yaw;
    const Turn& b = robot.pitch;
    const std::int64_t ahead = (dx * a.cosine + dy * a.sine) / a.denominator;
    const std::int64_t left = (dy * a.cosine - dx * a.sine) / a.denominator;
    if (options_.only_ahead && 10 * std::abs(left) > 7 * ahead) return;
    const std::int64_t forward = (ahead * b.cosine - dz * b.sine) / b.denominator;
    const std::int64_t up = (ahead * b.sine + dz * b.cosine) / b.denominator;
    for (const std::int64_t mm : {forward, left, up}) {
      scan.xyz.push_back(static_cast<float>(mm) / 1000.0F);
    }
  }

  Options options_;
  std::vector<Block> blocks_;
};

}  // namespace unimapper::test
