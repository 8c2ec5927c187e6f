#include "run_writer.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

namespace unimapper::simulator {
namespace {

static_assert(std::endian::native == std::endian::little, "the formats are little endian");

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  const int error = errno;
  throw SimulationError(std::string("cannot ") + what + " " + path.string() + ": " +
                        (error != 0 ? std::strerror(error) : "unknown reason"));
}

void write_file(const std::filesystem::path& path, const void* data, std::size_t bytes) {
  errno = 0;
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail(path, "create");
  const bool written = std::fwrite(data, 1, bytes, file) == bytes && std::fflush(file) == 0;
  const int error = errno;
  const bool closed = std::fclose(file) == 0;
  if (!written) errno = error;
  if (!written || !closed) fail(path, "write");
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  write_file(path, text.data(), text.size());
}

std::string numbered(std::uint32_t index, const char* extension) {
  char name[32];
  std::snprintf(name, sizeof name, "%06u.%s", index, extension);
  return name;
}

void make_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path)) {
    throw SimulationError("cannot make the folder " + path.string() + ": " +
                          (error ? error.message() : "a file is in the way"));
  }
}

const char* name_of(DriftPreset drift) {
  switch (drift) {
    case DriftPreset::kNone:
      return "none";
    case DriftPreset::kLio:
      return "lio";
    case DriftPreset::kIcp:
      return "icp";
    case DriftPreset::kBad:
      return "bad";
  }
  return "";
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

/// The smallest box around a mesh, in its own frame.
struct MeshBox {
  Vec3 low, high;
};

MeshBox box_of(const Mesh& mesh) {
  MeshBox box{{1e9, 1e9, 1e9}, {-1e9, -1e9, -1e9}};
  for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3) {
    const float* p = &mesh.positions[i];
    box.low = {std::min<double>(box.low.x, p[0]), std::min<double>(box.low.y, p[1]),
               std::min<double>(box.low.z, p[2])};
    box.high = {std::max<double>(box.high.x, p[0]), std::max<double>(box.high.y, p[1]),
                std::max<double>(box.high.z, p[2])};
  }
  return box;
}

/// Entries of what differs from a level sensor, level and undistorted odometry.
template <typename Entry, typename Quoted>
void add_attitude(const SimulationConfig& config, const Entry& entry, const Quoted& quoted) {
  if (!config.mount.is_level()) {
    entry("mount_roll_deg", number(config.mount.roll_deg));
    entry("mount_pitch_deg", number(config.mount.pitch_deg));
  }
  if (config.odometry_start == OdometryStart::kIdentity) {
    entry("odometry_start", quoted("identity"));
  }
  if (config.points == PointFrame::kBody) entry("points", quoted("body"));
  if (config.attitude_noise.sigma_deg != 0.0) {
    entry("attitude_noise_deg", number(config.attitude_noise.sigma_deg));
    entry("attitude_noise_correlated_s", number(config.attitude_noise.correlated_s));
  }
  if (config.sway.amplitude_deg != 0.0) {
    entry("sway_deg", number(config.sway.amplitude_deg));
    entry("sway_hz", number(config.sway.frequency_hz));
  }
  if (config.is_distorted) entry("distortion", "true");
}

}  // namespace

RunWriter::RunWriter(std::filesystem::path folder) : folder_(std::move(folder)) {
  make_folder(folder_ / "scans");
  make_folder(folder_ / "labels");
}

void RunWriter::write_scan(std::uint32_t index, const std::vector<LidarReturn>& returns) const {
  std::vector<float> points;
  std::vector<std::uint32_t> labels;
  points.reserve(4 * returns.size());
  labels.reserve(returns.size());
  for (const LidarReturn& r : returns) {
    points.push_back(static_cast<float>(r.point.x));
    points.push_back(static_cast<float>(r.point.y));
    points.push_back(static_cast<float>(r.point.z));
    points.push_back(r.intensity);
    labels.push_back(static_cast<std::uint32_t>(r.object) << 16U | r.label);
  }
  write_file(folder_ / "scans" / numbered(index, "bin"), points.data(),
             points.size() * sizeof(float));
  write_file(folder_ / "labels" / numbered(index, "label"), labels.data(),
             labels.size() * sizeof(std::uint32_t));
}

void RunWriter::write_poses(const char* name, const std::vector<Frame>& poses) const {
  std::string text;
  for (const Frame& p : poses) {
    char line[400];
    std::snprintf(
        line, sizeof line, "%.9f %.9f %.9f %.6f %.9f %.9f %.9f %.6f %.9f %.9f %.9f %.6f\n", p.x.x,
        p.y.x, p.z.x, p.origin.x, p.x.y, p.y.y, p.z.y, p.origin.y, p.x.z, p.y.z, p.z.z, p.origin.z);
    text += line;
  }
  write_text(folder_ / name, text);
}

void RunWriter::write_motions(const std::vector<ObjectMotion>& motions) const {
  std::string text;
  for (const ObjectMotion& motion : motions) {
    text += std::to_string(motion.object) + ' ' + std::to_string(motion.first_scan) + ' ' +
            std::to_string(motion.last_scan) + '\n';
  }
  write_text(folder_ / "motion.txt", text);
}

void RunWriter::write_objects(const World& world) const {
  std::vector<MeshBox> boxes;
  for (const Mesh& mesh : world.prototypes.meshes) boxes.push_back(box_of(mesh));
  std::string text = "# label x y z yaw length width height (metres, radians)\n";
  for (const Instance& instance : world.instances) {
    const MeshBox& box = boxes[instance.prototype];
    const Vec3 centre = instance.frame(0.5 * instance.scale * (box.low + box.high));
    const Vec3 size = instance.scale * (box.high - box.low);
    const double yaw = std::atan2(instance.frame.x.y, instance.frame.x.x);
    char line[160];
    std::snprintf(line, sizeof line, "%u %.3f %.3f %.3f %.4f %.3f %.3f %.3f\n",
                  static_cast<unsigned>(instance.label), centre.x, centre.y, centre.z, yaw, size.x,
                  size.y, size.z);
    text += line;
  }
  write_text(folder_ / "objects.txt", text);
}

void RunWriter::write_times(const std::vector<double>& stamps_s) const {
  std::string text;
  for (const double stamp : stamps_s) {
    char line[48];
    std::snprintf(line, sizeof line, "%.9f\n", stamp);
    text += line;
  }
  write_text(folder_ / "times.txt", text);
}

void RunWriter::write_description(const SimulationConfig& config, std::uint32_t day,
                                  std::uint32_t first_stamp_ms) const {
  std::string text = "{\n";
  const auto entry = [&](const char* key, const std::string& value, bool is_last = false) {
    text += std::string("  \"") + key + "\": " + value + (is_last ? "\n" : ",\n");
  };
  const auto quoted = [](std::string_view value) { return '"' + std::string(value) + '"'; };
  entry("format", quoted("unimapper-simulation"));
  entry("version", "1");
  entry("scene", quoted(config.scene));
  entry("sensor", quoted(sensor_model(config.sensor).name));
  entry("route", quoted(std::string_view(&config.route, 1)));
  entry("scans", std::to_string(config.scans));
  entry("seed", std::to_string(config.seed));
  entry("day", std::to_string(day));
  entry("drift", quoted(name_of(config.drift)));
  entry("thin", std::to_string(config.thin));
  if (config.sampling.columns != 0) entry("columns", std::to_string(config.sampling.columns));
  if (config.sampling.rings != 0) entry("rings", std::to_string(config.sampling.rings));
  if (config.sampling.uneven_rings) entry("uneven_rings", "true");
  add_attitude(config, entry, quoted);
  entry("scan_rate_hz", "10");
  entry("first_stamp_ms", std::to_string(first_stamp_ms));
  entry("labels", quoted("semantickitti"), true);
  text += "}\n";
  write_text(folder_ / "dataset.json", text);
}

}  // namespace unimapper::simulator
