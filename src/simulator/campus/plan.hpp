// Site plan of the campus: halls, paths, plaza, terrace and terrain height.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "src/simulator/path.hpp"
#include "src/simulator/terrain.hpp"

namespace unimapper::simulator::campus {

/// Axis-aligned rectangle of the plan.
struct Area {
  Vec2 low, high;

  [[nodiscard]] bool contains(Vec2 p, double margin = 0.0) const {
    return p.x > low.x - margin && p.y > low.y - margin && p.x < high.x + margin &&
           p.y < high.y + margin;
  }
  [[nodiscard]] Vec2 centre() const { return 0.5 * (low + high); }
};

enum class Side : std::uint8_t { kSouth, kEast, kNorth, kWest };

/// A large building.
struct Hall {
  Area area;  ///< of the upper floors
  Side front = Side::kSouth;
  int storeys = 3;
  double recess = 0.0;  ///< how far the ground floor's front stands back below the upper floors
  bool has_columns = false;  ///< along the recess (arcade); otherwise the upper floors overhang
  double passage_from = 0.0, passage_to = 0.0;  ///< along the front; a way through if not empty
  double turn = 0.0;                            ///< radians about the middle
};

/// A way between two nodes of the network.
struct Way {
  std::vector<Vec2> points;  ///< a metre apart
  double half_width = 0.0;   ///< metres of pavement either side; 0 across the plaza and terrace
};

enum class FixtureKind : std::uint8_t { kFountain, kBench, kPlanter, kKiosk, kStall };

/// An obstacle on the plaza.
struct Fixture {
  FixtureKind kind;
  Vec2 at;
  double turn, radius;
};

/// Plan coordinates are those of the scene. Halls and nodes keep their order from seed to seed;
/// distances, storeys, hills and curves differ.
class Plan : public Terrain {
 public:
  explicit Plan(std::uint64_t seed);

  /// Ground with terrace, ramps and stairs (as a slope through their edges).
  [[nodiscard]] double height(Vec2 at) const override { return hills(at) + lift(at); }
  [[nodiscard]] double walking_height(Vec2 at) const override { return height(at); }
  [[nodiscard]] Vec3 up(Vec2 at) const override;
  /// Natural terrain height.
  [[nodiscard]] double hills(Vec2 at) const;
  /// Height that terrace, ramps and stairs add to it.
  [[nodiscard]] double lift(Vec2 at) const;
  [[nodiscard]] Vec3 ground(Vec2 at, double above = 0.0) const {
    return {at.x, at.y, height(at) + above};
  }

  [[nodiscard]] std::span<const Hall> halls() const { return halls_; }
  [[nodiscard]] std::span<const Way> ways() const { return ways_; }
  [[nodiscard]] std::span<const Fixture> fixtures() const { return fixtures_; }
  [[nodiscard]] const Area& plaza() const { return plaza_; }
  [[nodiscard]] const Area& terrace() const { return terrace_; }
  [[nodiscard]] const Area& stairs() const { return stairs_; }
  [[nodiscard]] std::span<const Area> ramps() const { return ramps_; }
  [[nodiscard]] const Area& parking() const { return parking_; }
  /// Where people queue before the kiosk.
  [[nodiscard]] const Area& queue() const { return queue_; }
  /// Footbridge between two halls, one floor up.
  [[nodiscard]] const Area& bridge() const { return bridge_; }
  /// Area that is modelled finely.
  [[nodiscard]] const Area& grounds() const { return grounds_; }

  /// The robot's closed tour: A and B run the same way around the plaza, C against them; each
  /// comes back to it after the tour.
  [[nodiscard]] const Path& tour(char route) const;
  /// Closed walks along the paths; the first `kStairWalks` use the stairs, `kPastPlaza` and the
  /// last are wide enough for a delivery van.
  [[nodiscard]] std::span<const Path> walks() const { return walks_; }
  static constexpr std::size_t kStairWalks = 2;
  static constexpr std::size_t kPastPlaza = 9;

  /// True if a disc touches no hall, no path and none of the walks.
  [[nodiscard]] bool is_free(Vec2 at, double radius) const;
  /// Distance from the robot's tours.
  [[nodiscard]] double to_tours(Vec2 at) const;
  /// How far `at` is from the nearest pavement; negative on it.
  [[nodiscard]] double to_pavement(Vec2 at) const;

 private:
  struct Wave {
    double amplitude, kx, ky, phase;
    [[nodiscard]] double at(Vec2 p) const {
      return amplitude * std::sin(kx * p.x + ky * p.y + phase);
    }
  };

  void lay_out_halls(std::uint64_t seed);
  void lay_out_ways(std::uint64_t seed);
  void lay_out_fixtures();
  [[nodiscard]] Vec2 scaled(Vec2 p) const { return {stretch_.x * p.x, stretch_.y * p.y}; }
  [[nodiscard]] Area scaled(const Area& a) const { return {scaled(a.low), scaled(a.high)}; }
  [[nodiscard]] Vec2 node(int index) const;
  [[nodiscard]] Path through(std::span<const int> nodes) const;
  [[nodiscard]] bool is_pavement_free(Vec2 at, double radius) const;

  Vec2 stretch_;
  std::array<Wave, 3> hills_{};
  Area plaza_, terrace_, stairs_, parking_, queue_, bridge_, grounds_;
  std::array<Area, 2> ramps_;
  std::vector<Hall> halls_;
  std::vector<Way> ways_;
  std::vector<Fixture> fixtures_;
  std::vector<Path> tours_, walks_;
};

}  // namespace unimapper::simulator::campus
