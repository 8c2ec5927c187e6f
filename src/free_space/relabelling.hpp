// Relabelling of cells with the evidence of later keyframes
//
// Robot (final labels) and base (refined labels) label cells again when the evidence of later
// keyframes is there. Which cells belong together, and which keyframes are evidence, is up to them;
// what follows from the evidence is decided here.
#pragma once

#include <cstdint>

#include "components.hpp"
#include "evidence_sum.hpp"

namespace unimapper {

/// What is known of one cell beside the class of its group.
struct RelabelledCell {
  /// Its label by itself: the label it had, or the mean evidence around it.
  bool dynamic = false;
  bool confirmed_static = false;  ///< its own evidence is so strong that no group overrules it
  /// Its own evidence, or a part that moved (`MovedPart`), makes it dynamic: no group overrules it.
  bool confirmed_dynamic = false;
};

/// Whether a cell of a group of that class is dynamic.
[[nodiscard]] constexpr bool is_dynamic_relabelled(ComponentClass group,
                                                   const RelabelledCell& cell) noexcept {
  switch (group) {
    case ComponentClass::kDynamic:
      return cell.dynamic || !cell.confirmed_static;
    case ComponentClass::kStatic:
      return cell.confirmed_dynamic;
    case ComponentClass::kMixed:
      break;
  }
  return cell.dynamic;
}

/// Thousandths per cell; with less a component is not dynamic as a whole.
inline constexpr std::int64_t kLeastMeanOfDynamic = -200;

/// Class of a component with so much evidence, `dynamic` of whose cells were seen through or lie
/// among such. Few of those carry the mean of many others with them, so that what contradicts the
/// rest counts, too.
[[nodiscard]] inline ComponentClass class_by_share(const EvidenceSum& sum, std::uint32_t dynamic,
                                                   float dynamic_share,
                                                   float static_share) noexcept {
  const ComponentClass by_share = classify(dynamic, sum.cells, dynamic_share, static_share);
  const bool contradicted = sum.mean() < kLeastMeanOfDynamic;
  return by_share == ComponentClass::kDynamic && contradicted ? ComponentClass::kMixed : by_share;
}

/// Class of cells that are next to each other, where components are out of reach. To remove what
/// was kept takes more than a tie: more than `least_dynamic` (thousandths) a cell.
[[nodiscard]] inline ComponentClass class_by_mean(const EvidenceSum& sum,
                                                  std::int32_t least_dynamic) noexcept {
  if (sum.log_odds > std::int64_t{least_dynamic} * sum.cells) return ComponentClass::kDynamic;
  return sum.log_odds < 0 ? ComponentClass::kStatic : ComponentClass::kMixed;
}

}  // namespace unimapper
