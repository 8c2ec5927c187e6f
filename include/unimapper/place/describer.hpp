// DynaSTD descriptor: keypoints and planes from the static cells of a keyframe.
#pragma once

#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper {

/// Describes keyframes (paper section V-A). Works in the levelled keyframe frame, so the result
/// depends neither on the odometry frame's origin nor on its yaw, and not on the order in
/// which the cells come. A handle: copies stand for the same describer.
class PlaceDescriber {
 public:
  /// Takes all memory it will ever need from `arena`, its state included. Describes nothing where
  /// the arena was measuring or too small. `input`: the cells it will be given.
  void allocate(Arena& arena, const DescriptorConfig& config,
                const DescriptorInput& input = {}) noexcept;
  /// Takes the memory that is kept between descriptions, for callers with other uses for the rest.
  void allocate_kept(Arena& arena, const DescriptorConfig& config,
                     const DescriptorInput& input) noexcept;
  /// Takes, after `allocate_kept`, what is in use only from the beginning of a description to its
  /// last step.
  void allocate_scratch(Arena& arena, const DescriptorConfig& config,
                        const DescriptorInput& input) noexcept;

  /// Describes one keyframe. The view stays valid until the next description begins. Bounded by
  /// the configured capacities; what did not fit is in `dropped()`.
  PlaceView describe(std::span<const FineCell> cells) noexcept;

  /// Begins a description in steps with a bound, for callers who have little time at once. `step`
  /// follows until it returns false, then `place()`. The cells stay valid until then.
  void begin(std::span<const FineCell> cells) noexcept;
  /// The next step: at most 16,384 cells or 1,024 plane fits, or one pass over the
  /// grid. False once nothing is left.
  bool step() noexcept;
  /// About how many steps are left; 0 exactly when none is.
  [[nodiscard]] std::uint32_t steps_left() const noexcept;
  /// What the last description found, once no step is left.
  [[nodiscard]] PlaceView place() const noexcept;

  /// The planes alone, as `describe` finds them, for callers with cells and keypoints at hand.
  /// Valid until the next call.
  std::span<const PlanePatch> find_planes(std::span<const FineCell> cells) noexcept;

  /// Cells, voxels and keypoints refused because a container was full in the last description.
  [[nodiscard]] std::uint64_t dropped() const noexcept;

 private:
  class State;
  State* state_ = nullptr;
};

}  // namespace unimapper
