// Options of `unimapper merge` for listening to live sessions.
#pragma once

#include "ports/lcm/live.hpp"
#include "src/apps/merge/options.hpp"

namespace unimapper::apps {

/// What `--listen` and the options beside it ask of the network; told about on stderr. O(1).
lcm_port::ListenOptions listen_options(const MergeOptions& options);

}  // namespace unimapper::apps
