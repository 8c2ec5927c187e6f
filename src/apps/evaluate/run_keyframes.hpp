// Keyframes of a run with their true poses.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "src/evaluate/loops.hpp"

namespace unimapper::apps {

/// The keyframes of a run in ascending order.
struct RunKeyframes {
  std::string session;
  std::vector<evaluate::TrueKeyframe> keyframes;
};

/// Reads RUN/keyframes.lcmlog and looks every reference scan up in the ground truth of
/// `dataset`. Throws std::runtime_error when the log holds no keyframe, or one of a scan that
/// the dataset doesn't have.
[[nodiscard]] RunKeyframes read_run_keyframes(const std::filesystem::path& run,
                                              const std::filesystem::path& dataset);

}  // namespace unimapper::apps
