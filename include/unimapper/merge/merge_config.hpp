#pragma once

namespace unimapper::merge {
/// Parameters of the merger.
struct MergeConfig {};
}  // namespace unimapper::merge
