// Times of robots and of a merge in the page of a map.
#pragma once

#include "src/apps/report.hpp"

namespace unimapper::apps {

/// Makes `files.times`: `online`, the total time per keyframe on the robots whose stats.json is
/// there, and `timing`, the stages of the merge, each with the load under which it was taken
/// (docs/api.md).
void add_times(MapFiles& files, const ReportInput& input);

}  // namespace unimapper::apps
