// Writer of scenes as MCAP files of Foxglove's messages.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ports/bag_writers/foxglove_schemas.hpp"
#include "ports/bag_writers/mcap_writer.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::bags {

/// Eight bits a channel.
struct Rgba {
  std::uint8_t red = 0, green = 0, blue = 0, alpha = 255;
};

/// Writes point clouds, poses, transforms and lines that Foxglove and its relatives show. Clouds
/// are PointCloud2 of ROS 2, binary; all else is JSON in Foxglove's schemas. A topic holds messages
/// of one kind. All members throw BagError.
class FoxgloveWriter {
 public:
  explicit FoxgloveWriter(const std::filesystem::path& file);

  /// 12 bytes a point, and four of a colour, one of an intensity (`intensities`: of each, or none).
  /// Without either, viewers colour by height.
  void write_cloud(std::string_view topic, std::string_view frame, std::int64_t stamp_ns,
                   std::span<const Eigen::Vector3f> points, std::optional<Rgba> color,
                   std::span<const std::uint8_t> intensities = {});
  /// Poses T_frame_x, shown together.
  void write_poses(std::string_view topic, std::string_view frame, std::int64_t stamp_ns,
                   std::span<const Pose> poses);
  /// One pose of a moving frame.
  void write_pose(std::string_view topic, std::string_view frame, std::int64_t stamp_ns,
                  const Pose& pose);
  /// T_parent_child from `stamp_ns` on, topic /tf.
  void write_transform(std::string_view parent, std::string_view child, std::int64_t stamp_ns,
                       const Pose& transform);
  /// Straight lines between pairs of points, shown until the end; `id` is unique on the topic.
  void write_lines(std::string_view topic, std::string_view frame, std::int64_t stamp_ns,
                   std::string_view id,
                   std::span<const std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines,
                   const Rgba& color);
  /// Must be the last call.
  void close() { writer_.close(); }

 private:
  void write(std::string_view topic, FoxgloveSchema schema, std::int64_t stamp_ns,
             std::string_view message);
  void write(std::string_view topic, std::uint16_t schema, std::string_view encoding,
             std::int64_t stamp_ns, std::string_view message);

  McapWriter writer_;
  std::map<FoxgloveSchema, std::uint16_t> schemas_;
  std::uint16_t cloud_schema_ = 0;  // unknown to the file
  std::map<std::string, std::uint16_t, std::less<>> channels_;
};

}  // namespace unimapper::bags
