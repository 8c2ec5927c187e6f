// Choice of the topics that a map is made of.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/messages.hpp"

namespace unimapper::datasets::bag {

/// "/points (sensor_msgs/PointCloud2, 312 messages)".
std::string describe(const Topic& topic);

/// The topics with messages of a kind for which `is_wanted` holds.
std::vector<std::size_t> find_topics(const MessageSource& source, bool (*is_wanted)(MessageKind));

/// The topic of the scans: the one named `wanted`, or the only one where that is empty. Throws
/// DatasetError (without naming a file) with the topics that there are.
std::size_t choose_scan_topic(const MessageSource& source, const std::string& wanted);

/// The topics that may hold the robot's poses: the one named `wanted`, which may be one of
/// transforms; else the only topic of odometry; else those of other poses; else those of paths.
/// Empty where there are none. Throws DatasetError where several topics of odometry fit.
std::vector<std::size_t> choose_pose_topics(const MessageSource& source, const std::string& wanted);

/// The topics of `sensor_msgs/Imu`: the one named `wanted`, or all where that is empty. Throws
/// DatasetError where the one named is none.
std::vector<std::size_t> choose_imu_topics(const MessageSource& source, const std::string& wanted);

/// Throws DatasetError that names the topics to choose from.
[[noreturn]] void fail_ambiguous(const MessageSource& source,
                                 const std::vector<std::size_t>& topics, const std::string& what,
                                 const std::string& option);

}  // namespace unimapper::datasets::bag
