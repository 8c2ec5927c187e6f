// Precision and recall of changed objects.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "unimapper/core/changed_object.hpp"

namespace unimapper::evaluate {

/// An object that stands in a scene on one day.
struct StandingObject {
  int label = 0;   ///< of its kind
  UprightBox box;  ///< world frame
};

/// An object that differs between two visits, in truth.
struct TrueChange {
  int label = 0;                              ///< of its kind
  ChangeKind change = ChangeKind::kAppeared;  ///< never `kMoved`
  UprightBox box;                             ///< world frame
  /// Something else stands there on the other day, so that only its outline changed.
  bool is_replaced = false;
  /// Whether both visits could see it: one the object, the other through its place.
  bool is_observable = false;
};

/// A change as it was found.
struct FoundChange {
  ChangeKind change = ChangeKind::kAppeared;  ///< moved: matches both others
  UprightBox box;                             ///< world frame
};

/// Two boxes are the same object if each holds the other's centre, seen from above, within this.
inline constexpr double kSameObject_m = 0.3;

/// Whether two boxes are the same object.
[[nodiscard]] bool is_same_object(const UprightBox& a, const UprightBox& b);

/// What stands on one of the days only, in the order of `earlier`, then of `later`: nothing with
/// the same label stands within 2 cm of it on the other. O(n^2).
[[nodiscard]] std::vector<TrueChange> true_changes(std::span<const StandingObject> earlier,
                                                   std::span<const StandingObject> later);

/// What a found change is.
enum class FoundClass {
  kRight,     ///< a true change, and the first one found for it
  kReplaced,  ///< a change of an object in whose place another one stands
  kPart,      ///< a part of an object that did change
  kStood,     ///< something else that stood there during one visit: persons, waiting cars
  kWrong,
};

/// How changes that were found agree with the truth.
struct ChangeScore {
  std::vector<FoundClass> found;    ///< what each found one is
  std::size_t changed = 0;          ///< true changes that count: observable, not replaced
  std::vector<std::size_t> missed;  ///< indices of those that were not found

  [[nodiscard]] std::size_t count(FoundClass what) const;  ///< found ones of that class
  /// Share of what lies on something that changed among this and what is wrong; NaN without any.
  [[nodiscard]] double precision() const;
  [[nodiscard]] double recall() const;  ///< NaN if nothing changed
};

/// Pairs every found change with the nearest true one of the same kind of change, each once.
/// `stood[i]`: whether found change i is something that stood there during one visit. Recall is
/// about true changes with one of `labels`. O(found x truth).
[[nodiscard]] ChangeScore score_changes(std::span<const FoundChange> found,
                                        std::span<const TrueChange> truth,
                                        const std::vector<bool>& stood,
                                        std::span<const int> labels);

}  // namespace unimapper::evaluate
