// Accuracy of a run's labels, for reports
#pragma once

#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {

/// Accuracy of a run's online labels, per point. Without ground-truth labels no point counts.
struct RemovalScore {
  evaluate::Tally all;     ///< whatever has a dynamic label: a bus at its stop as well
  evaluate::Tally moving;  ///< static points, and objects that moved while they were seen
};

}  // namespace unimapper::apps
