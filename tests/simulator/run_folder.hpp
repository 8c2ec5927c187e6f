// Readers of the files of simulated recordings.
#pragma once

#include "src/simulator/geometry.hpp"
#include "src/simulator/simulate.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

namespace unimapper::simulator::test {

struct LabelledPoint {
  float x, y, z, intensity;
  std::uint16_t label, object;
};

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::string numbered(std::size_t index, const char* extension) {
  std::string name = std::to_string(index);
  return std::string(6 - name.size(), '0') + name + extension;
}

/// Points of one scan with their labels; empty if the files disagree.
inline std::vector<LabelledPoint> read_scan(const std::filesystem::path& run, std::size_t index) {
  const std::string points = read_bytes(run / "scans" / numbered(index, ".bin"));
  const std::string labels = read_bytes(run / "labels" / numbered(index, ".label"));
  std::vector<LabelledPoint> scan(points.size() / 16);
  if (points.size() % 16 != 0 || labels.size() != 4 * scan.size()) return {};
  for (std::size_t i = 0; i < scan.size(); ++i) {
    points.copy(reinterpret_cast<char*>(&scan[i].x), 16, 16 * i);
    labels.copy(reinterpret_cast<char*>(&scan[i].label), 4, 4 * i);
  }
  return scan;
}

inline std::vector<Frame> read_poses(const std::filesystem::path& path) {
  std::vector<Frame> poses;
  std::ifstream file(path);
  std::array<double, 12> v{};
  while (true) {
    for (double& value : v) file >> value;
    if (!file) return poses;
    poses.push_back(
        {{v[0], v[4], v[8]}, {v[1], v[5], v[9]}, {v[2], v[6], v[10]}, {v[3], v[7], v[11]}});
  }
}

/// A short drive, with one column in `thin`.
inline SimulationConfig short_drive(SensorKind sensor, std::uint32_t scans, std::uint64_t seed,
                                    std::uint32_t thin = 16) {
  SimulationConfig config;
  config.sensor = sensor;
  config.scans = scans;
  config.thin = thin;
  config.seed = seed;
  return config;
}

/// The files of a simulated recording.
struct Recording {
  explicit Recording(const SimulationConfig& config) {
    simulate(config, folder.path());
    for (std::size_t i = 0; i < config.scans; ++i) scans.push_back(read_scan(folder.path(), i));
    truth = read_poses(folder / "gt_poses.txt");
    odometry = read_poses(folder / "poses.txt");
  }
  [[nodiscard]] std::string bytes_of(const std::string& file) const {
    return read_bytes(folder / file);
  }

  TemporaryDirectory folder;
  std::vector<std::vector<LabelledPoint>> scans;
  std::vector<Frame> truth, odometry;
};

inline Vec3 position(const LabelledPoint& p) { return {p.x, p.y, p.z}; }

inline bool is_moving(const LabelledPoint& p) { return p.label >= 252; }

}  // namespace unimapper::simulator::test
