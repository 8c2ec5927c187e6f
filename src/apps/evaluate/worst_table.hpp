// Report of a run's worst frames as Markdown and JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "src/evaluate/worst_frames.hpp"

namespace unimapper::apps {

/// An object of a frame, and whether it moved.
struct FrameObject {
  evaluate::ObjectErrors errors;
  double moved_m = 0.0;  ///< between this scan and `scans_between` earlier or later; NaN if unseen
};

/// One of the worst frames.
struct WorstFrame {
  std::string name;  ///< the scan's
  std::size_t scan = 0;
  evaluate::DynamicScore score;
  std::vector<FrameObject> objects;  ///< those with wrong points, the worst first
  std::string range_image;           ///< file names beside the table
  std::string top_view;
};

/// Markdown with the pictures inside.
[[nodiscard]] std::string worst_markdown(const std::vector<WorstFrame>& frames,
                                         std::size_t scans_between);

/// JSON with the figures of `worst_markdown`, for programs.
[[nodiscard]] std::string worst_json(const std::vector<WorstFrame>& frames,
                                     std::size_t scans_between);

}  // namespace unimapper::apps
