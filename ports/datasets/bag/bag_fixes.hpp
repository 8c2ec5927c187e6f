// Positions of a receiver of satellites in a bag.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/transform_tree.hpp"
#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets::bag {

/// The fixes of one topic, in the order of recording.
struct FixTopic {
  std::string description;           ///< of the topic
  std::vector<FixMessage> recorded;  ///< usable or not
};

/// The usable fixes of the topic whose deviations tell most, with the antenna's place in the
/// LiDAR's frame where transforms tell it. Says what was chosen and left out.
[[nodiscard]] std::vector<Fix> choose_fixes(const std::map<std::size_t, FixTopic>& topics,
                                            const TransformTree& transforms,
                                            const std::string& lidar_frame,
                                            std::vector<Note>& notes);

}  // namespace unimapper::datasets::bag
