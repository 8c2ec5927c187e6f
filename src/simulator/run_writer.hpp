// Writer of the files of a simulated recording.
#pragma once

#include <filesystem>
#include <vector>

#include "scanner.hpp"
#include "scene.hpp"
#include "simulate.hpp"

namespace unimapper::simulator {

/// Writes below one folder. Throws SimulationError with the file and the reason.
class RunWriter {
 public:
  explicit RunWriter(std::filesystem::path folder);

  /// Scan and labels of scan `index`; thread safe for different scans.
  void write_scan(std::uint32_t index, const std::vector<LidarReturn>& returns) const;
  void write_poses(const char* name, const std::vector<Frame>& poses) const;
  void write_motions(const std::vector<ObjectMotion>& motions) const;
  /// What stands in the scene and could stand elsewhere on another day.
  void write_objects(const World& world) const;
  void write_times(const std::vector<double>& stamps_s) const;
  void write_description(const SimulationConfig& config, std::uint32_t day,
                         std::uint32_t first_stamp_ms) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace unimapper::simulator
