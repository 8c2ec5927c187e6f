#include "changed_objects.hpp"

#include <algorithm>
#include <limits>
#include <tuple>

namespace unimapper::evaluate {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);
/// Positions are written in millimetres.
constexpr double kSamePlace_m = 0.02;

double share(std::size_t part, std::size_t all) {
  if (all == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(part) / static_cast<double>(all);
}

bool stands_among(const StandingObject& object, std::span<const StandingObject> others) {
  return std::any_of(others.begin(), others.end(), [&](const StandingObject& other) {
    return other.label == object.label &&
           (other.box.centre - object.box.centre).norm() < kSamePlace_m;
  });
}

void add_missing(std::span<const StandingObject> objects, std::span<const StandingObject> others,
                 ChangeKind change, std::vector<TrueChange>& changes) {
  for (const StandingObject& object : objects) {
    if (stands_among(object, others)) continue;
    const bool is_replaced =
        std::any_of(others.begin(), others.end(), [&](const StandingObject& other) {
          return other.box.covers(object.box.centre) || object.box.covers(other.box.centre);
        });
    changes.push_back({object.label, change, object.box, is_replaced, false});
  }
}

/// Of each found change the true one, or `kNone`.
std::vector<std::size_t> match_changes(std::span<const FoundChange> found,
                                       std::span<const TrueChange> truth) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t f = 0; f < found.size(); ++f) {
    for (std::size_t t = 0; t < truth.size(); ++t) {
      const bool is_kind =
          found[f].change == ChangeKind::kMoved || found[f].change == truth[t].change;
      if (!is_kind || !is_same_object(found[f].box, truth[t].box)) continue;
      pairs.emplace_back((found[f].box.centre - truth[t].box.centre).norm(), f, t);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::size_t> match(found.size(), kNone);
  std::vector<bool> is_taken(truth.size(), false);
  for (const auto& [distance, f, t] : pairs) {
    if (match[f] != kNone || is_taken[t]) continue;
    match[f] = t;
    is_taken[t] = true;
  }
  return match;
}

bool lies_on(const FoundChange& found, const TrueChange& truth) {
  return truth.box.covers(found.box.centre, kSameObject_m);
}

}  // namespace

bool is_same_object(const UprightBox& a, const UprightBox& b) {
  return a.covers(b.centre, kSameObject_m) && b.covers(a.centre, kSameObject_m);
}

std::vector<TrueChange> true_changes(std::span<const StandingObject> earlier,
                                     std::span<const StandingObject> later) {
  std::vector<TrueChange> changes;
  add_missing(earlier, later, ChangeKind::kGone, changes);
  add_missing(later, earlier, ChangeKind::kAppeared, changes);
  return changes;
}

std::size_t ChangeScore::count(FoundClass what) const {
  return static_cast<std::size_t>(std::count(found.begin(), found.end(), what));
}

double ChangeScore::precision() const {
  const std::size_t changed_ones =
      count(FoundClass::kRight) + count(FoundClass::kReplaced) + count(FoundClass::kPart);
  return share(changed_ones, changed_ones + count(FoundClass::kWrong));
}

double ChangeScore::recall() const { return share(changed - missed.size(), changed); }

ChangeScore score_changes(std::span<const FoundChange> found, std::span<const TrueChange> truth,
                          const std::vector<bool>& stood, std::span<const int> labels) {
  const std::vector<std::size_t> match = match_changes(found, truth);
  ChangeScore score;
  std::vector<bool> is_found(truth.size(), false);
  for (std::size_t i = 0; i < found.size(); ++i) {
    FoundClass what = stood[i] ? FoundClass::kStood : FoundClass::kWrong;
    if (match[i] != kNone) {
      is_found[match[i]] = true;
      what = truth[match[i]].is_replaced ? FoundClass::kReplaced : FoundClass::kRight;
    } else if (std::any_of(truth.begin(), truth.end(),
                           [&](const TrueChange& t) { return lies_on(found[i], t); })) {
      what = FoundClass::kPart;
    }
    score.found.push_back(what);
  }
  for (std::size_t t = 0; t < truth.size(); ++t) {
    const bool counts = std::find(labels.begin(), labels.end(), truth[t].label) != labels.end();
    if (!counts || !truth[t].is_observable || truth[t].is_replaced) continue;
    ++score.changed;
    if (!is_found[t]) score.missed.push_back(t);
  }
  return score;
}

}  // namespace unimapper::evaluate
