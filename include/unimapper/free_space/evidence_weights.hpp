// Log-odds weights of free-space evidence
#pragma once

#include <cstdint>

namespace unimapper {

/// What robot and base agree on, measured once for both (docs/tuning.md): the base uses it, and a
/// robot unless it is configured otherwise. Log-odds are of "dynamic" (paper section IV-D, equation
/// 6).
struct EvidenceDefaults {
  static constexpr float kLogOddsFree = 0.85F;             ///< seen through
  static constexpr float kLogOddsOccupied = 0.425F;        ///< occupied in another keyframe
  static constexpr float kLogOddsWeaklyOccupied = 0.255F;  ///< a surface about there
  static constexpr float kPriorLogOdds = 1.5F;             ///< labelled dynamic online
  static constexpr float kConfirmedStaticLogOdds = 2.0F;   ///< a component cannot overrule it
  static constexpr float kRangeMarginM = 0.3F;             ///< of the visibility test
  static constexpr float kRangeMarginRelative = 0.01F;     ///< of the visibility test, by range
  static constexpr float kConnectingHeightM = 0.3F;        ///< lower cells connect no components
  static constexpr float kComponentStaticShare = 0.1F;     ///< below it a component is static
  static constexpr float kSeenThroughShare = 0.7F;         ///< from it on ground is none
  /// Points so high above the level of the ground are of feet: more than its roughness and noise.
  static constexpr float kFootHeightM = 0.04F;
};

/// Log-odds as whole thousandths: evidence for and against often weighs the same, and rounding
/// must not decide such a tie.
[[nodiscard]] inline std::int32_t in_thousandths(float log_odds) noexcept {
  return static_cast<std::int32_t>(log_odds * 1000.0F + 0.5F);
}

/// Weights of single observations, thousandths.
struct EvidenceWeights {
  std::int32_t free = in_thousandths(EvidenceDefaults::kLogOddsFree);  ///< seen through
  /// Occupied in another keyframe.
  std::int32_t occupied = in_thousandths(EvidenceDefaults::kLogOddsOccupied);
  /// A surface was observed close to it.
  std::int32_t weakly_occupied = in_thousandths(EvidenceDefaults::kLogOddsWeaklyOccupied);

  /// From the members that every configuration of evidence has.
  template <typename Config>
  [[nodiscard]] static EvidenceWeights of(const Config& config) noexcept {
    return {in_thousandths(config.log_odds_free), in_thousandths(config.log_odds_occupied),
            in_thousandths(config.log_odds_weakly_occupied)};
  }
};

}  // namespace unimapper
