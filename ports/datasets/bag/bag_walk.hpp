// First walk through a bag: stamps of the scans, and all poses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ports/datasets/bag/bag_fixes.hpp"
#include "ports/datasets/bag/bag_poses.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/recorded_stamps.hpp"

namespace unimapper::datasets::bag {

/// What the first walk through a bag collects.
struct Contents {
  /// A scan of the topic.
  struct ScanStamp {
    std::size_t number;     ///< among the messages of the topic
    std::int64_t stamp_ns;  ///< of its header; without one as `log_ns`
    std::int64_t log_ns;    ///< when it was recorded
    std::size_t lidar;      ///< index of `lidars`
  };
  /// What tells the LiDARs of one topic apart.
  struct Lidar {
    std::string frame;        ///< of its scans
    std::uint8_t number = 0;  ///< that Livox gives it
    std::size_t scans = 0;    ///< how many it has
  };
  std::vector<Lidar> lidars;      ///< on the topic, in the order of recording
  std::vector<ScanStamp> scans;   ///< of the LiDAR that was chosen, in the order of recording
  std::string lidar_frame;        ///< of the scans
  std::size_t without_frame = 0;  ///< scans
  std::size_t without_stamp = 0;  ///< scans
  RecordedStamps stamps;          ///< of the scans
  BagPoses poses;                 ///< of all topics that were walked
  std::map<std::size_t, FixTopic> fixes;  ///< by number of the topic
  std::size_t unreadable = 0;             ///< messages of all these topics
  std::size_t unreadable_scans = 0;       ///< unreadable messages of the scans' topic
  std::string first_unreadable;           ///< topic, number and reason
};

/// Reads the heads of the scans on a topic and all poses and fixes on others. Keeps the scans of
/// one LiDAR: `wanted_lidar` (its frame), or the only one where that is empty. `is_asked_for`:
/// poses of any kind count as odometry. Unreadable messages are counted. Throws DatasetError and
/// SeveralLidarsError (without naming a file).
[[nodiscard]] Contents walk_bag(MessageSource& source, std::size_t scan_topic,
                                const std::vector<std::size_t>& pose_topics, bool is_asked_for,
                                std::string wanted_lidar);

/// "1 message", "2 messages".
[[nodiscard]] std::string count_text(std::size_t count, const std::string& what);

}  // namespace unimapper::datasets::bag
