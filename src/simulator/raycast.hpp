// Ray casting with Embree.
//
// The static part of a scene is built once, the moving part once per scan.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "world.hpp"

namespace unimapper::simulator {

/// A prototype that moves during one sweep.
struct MovingInstance {
  std::uint32_t prototype;
  Frame begin, end;  ///< at the start and at the end of the sweep
  double scale;
  std::uint16_t label, object;
};

struct RayQuery {
  Vec3 origin, direction;  ///< world frame; direction of unit length
  float time;              ///< 0 at the start of the sweep, 1 at its end
  float near_m, far_m;
};

struct RayHit {
  float distance_m;  ///< negative if nothing was hit
  float cosine;      ///< of the angle of incidence, 0..1
  Surface surface;
  std::uint16_t label, object;
};

/// Static geometry. Thread safe for casting.
class StaticScene {
 public:
  explicit StaticScene(const World& world);
  ~StaticScene();
  StaticScene(const StaticScene&) = delete;
  StaticScene& operator=(const StaticScene&) = delete;

 private:
  friend class MovingScene;
  friend class Caster;
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Moving geometry of one sweep; one per thread.
class MovingScene {
 public:
  explicit MovingScene(const StaticScene& prototypes);
  ~MovingScene();
  MovingScene(const MovingScene&) = delete;
  MovingScene& operator=(const MovingScene&) = delete;
  /// Replaces the contents.
  void set(std::vector<MovingInstance> instances);

 private:
  friend class Caster;
  struct Data;
  std::unique_ptr<Data> data_;
};

/// Nearest hits of many rays; neighbouring queries should point in similar directions.
class Caster {
 public:
  Caster(const StaticScene& standing, const MovingScene& moving)
      : standing_(standing), moving_(moving) {}
  void cast(std::span<const RayQuery> queries, std::span<RayHit> hits) const;

 private:
  void cast_packet(std::span<const RayQuery> queries, std::span<RayHit> hits) const;

  const StaticScene& standing_;
  const MovingScene& moving_;
};

}  // namespace unimapper::simulator
