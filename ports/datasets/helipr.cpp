#include "ports/datasets/helipr.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/sequence.hpp"
#include "ports/datasets/text_encoding.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::array<HeliprSensor, 4> kSensors = {HeliprSensor::kAeva, HeliprSensor::kAvia,
                                                  HeliprSensor::kOuster, HeliprSensor::kVelodyne};

/// Aeva files recorded later carry one more float per point.
constexpr std::int64_t kLastShortAevaStamp_ns = 1691936557946849179;
constexpr std::size_t kShortAevaBytes = 25;
constexpr std::size_t kLongAevaBytes = 29;

std::size_t aeva_record_bytes(std::size_t bytes, std::int64_t stamp_ns) {
  const bool by_stamp_short = stamp_ns <= kLastShortAevaStamp_ns;
  const std::size_t expected = by_stamp_short ? kShortAevaBytes : kLongAevaBytes;
  const std::size_t other = by_stamp_short ? kLongAevaBytes : kShortAevaBytes;
  // Excerpts are renumbered, so the name may not be a stamp.
  return bytes % expected != 0 && bytes % other == 0 ? other : expected;
}

std::size_t record_bytes(HeliprSensor sensor, std::size_t bytes, std::int64_t stamp_ns) {
  switch (sensor) {
    case HeliprSensor::kOuster:
      return 26;
    case HeliprSensor::kVelodyne:
      return 22;
    case HeliprSensor::kAvia:
      return 19;
    case HeliprSensor::kAeva:
      break;
  }
  return aeva_record_bytes(bytes, stamp_ns);
}

template <typename Value>
Value load_value(const char* at) {
  Value value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

float load_float(const char* at) { return load_value<float>(at); }

/// When and by which laser a point was measured.
struct TimeAndRing {
  float time_s;
  std::uint16_t ring;
};

TimeAndRing time_and_ring(HeliprSensor sensor, const char* at) {
  constexpr double kNanosecond_s = 1e-9;
  const auto byte = [&](std::size_t offset) { return static_cast<std::uint8_t>(at[offset]); };
  const auto seconds = [](auto nanoseconds) {
    return static_cast<float>(kNanosecond_s * static_cast<double>(nanoseconds));
  };
  switch (sensor) {
    case HeliprSensor::kOuster:
      return {seconds(load_value<std::uint32_t>(at + 16)), load_value<std::uint16_t>(at + 22)};
    case HeliprSensor::kVelodyne:
      return {load_float(at + 18), load_value<std::uint16_t>(at + 16)};
    case HeliprSensor::kAvia:
      return {seconds(load_value<std::uint32_t>(at + 15)), byte(14)};
    case HeliprSensor::kAeva:
      break;
  }
  return {seconds(load_value<std::int32_t>(at + 20)), byte(24)};
}

}  // namespace

std::string_view helipr_directory(HeliprSensor sensor) {
  constexpr std::array<std::string_view, 4> kNames = {"Aeva", "Avia", "Ouster", "Velodyne"};
  return kNames[static_cast<std::size_t>(sensor)];
}

std::optional<HeliprSensor> find_helipr_sensor(std::string_view name) {
  for (const HeliprSensor sensor : kSensors) {
    if (lower_case(name) == lower_case(helipr_directory(sensor))) return sensor;
  }
  const SensorModel* model = find_sensor(name);
  if (model == nullptr) return std::nullopt;
  switch (model->kind) {
    case SensorKind::kAevaAeries2:
      return HeliprSensor::kAeva;
    case SensorKind::kLivoxAvia:
      return HeliprSensor::kAvia;
    case SensorKind::kOs2_128:
      return HeliprSensor::kOuster;
    case SensorKind::kVlp16:
      return HeliprSensor::kVelodyne;
    default:
      return std::nullopt;
  }
}

void parse_helipr(std::string_view bytes, HeliprSensor sensor, std::int64_t stamp_ns,
                  const fs::path& file, Scan& scan) {
  const std::size_t record = record_bytes(sensor, bytes.size(), stamp_ns);
  if (const std::size_t surplus = bytes.size() % record; surplus != 0) {
    fail_at_offset(file, bytes.size() - surplus,
                   "truncated: the last record has " + std::to_string(surplus) + " of " +
                       std::to_string(record) + " bytes");
  }
  scan.reset(bytes.size() / record);
  scan.time_s.resize(scan.points.size());
  scan.ring.resize(scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const char* at = bytes.data() + i * record;
    // Behind x, y, z all sensors have a float of returned power, but Avia one byte.
    const float intensity = sensor == HeliprSensor::kAvia
                                ? static_cast<float>(static_cast<std::uint8_t>(at[12]))
                                : load_float(at + 12);
    scan.points[i] = {load_float(at), load_float(at + 4), load_float(at + 8), intensity};
    const TimeAndRing of_point = time_and_ring(sensor, at);
    scan.time_s[i] = of_point.time_s;
    scan.ring[i] = of_point.ring;
  }
}

namespace {

class HeliprDataset : public SequenceDataset {
 public:
  HeliprDataset(HeliprSensor sensor, Sequence sequence)
      : SequenceDataset(std::move(sequence)), sensor_(sensor) {}

  void read_scan(std::size_t i, Scan& scan) const override {
    parse_helipr(read_file(file(i)), sensor_, stamp_ns(i), file(i), scan);
  }

  /// HeLiPR's poses are its ground truth.
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return sequence().poses; }

  [[nodiscard]] std::string sensor() const override {
    // "velodyne" and "ouster" are the VLP-16 and the OS2-128, as in HeLiPR.
    return std::string(find_sensor(helipr_directory(sensor_))->name);
  }

 private:
  HeliprSensor sensor_;
};

HeliprSensor choose_sensor(const fs::path& lidars, const std::string& wanted) {
  std::string present;
  std::vector<HeliprSensor> found;
  for (const HeliprSensor sensor : kSensors) {
    if (!fs::is_directory(lidars / helipr_directory(sensor))) continue;
    found.push_back(sensor);
    present += (present.empty() ? "" : ", ") + std::string(helipr_directory(sensor));
  }
  if (found.empty()) fail(lidars, "holds none of Aeva, Avia, Ouster, Velodyne");
  if (wanted.empty()) {
    if (found.size() == 1) return found.front();
    fail(lidars, "holds several LiDARs (" + present + "): choose one with --sensor");
  }
  const auto sensor = find_helipr_sensor(wanted);
  if (!sensor || std::find(found.begin(), found.end(), *sensor) == found.end()) {
    fail(lidars, "has no LiDAR '" + wanted + "'; there is " + present);
  }
  return *sensor;
}

fs::path find_ground_truth(const fs::path& directory, HeliprSensor sensor) {
  const fs::path folder = directory / "LiDAR_GT";
  const std::string name = std::string(helipr_directory(sensor)) + "_gt.txt";
  if (fs::exists(folder / name)) return folder / name;
  if (fs::exists(folder / ("global_" + name))) return folder / ("global_" + name);
  fail(folder / name, "no such file; HeLiPR scans need its poses");
}

std::int64_t stamp_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  const char* end = stem.data() + stem.size();
  std::int64_t stamp_ns = 0;
  const auto [parsed_to, error] = std::from_chars(stem.data(), end, stamp_ns);
  if (error != std::errc() || parsed_to != end) {
    fail(file, "the name of a HeLiPR scan must be its stamp in nanoseconds");
  }
  return stamp_ns;
}

}  // namespace

bool recognises_helipr(const fs::path& directory) {
  const fs::path lidars = find_child(directory, {"LiDAR"});
  return !lidars.empty() && !find_child(lidars, {"Aeva", "Avia", "Ouster", "Velodyne"}).empty();
}

std::unique_ptr<Dataset> open_helipr(const fs::path& directory, const OpenOptions& options) {
  const fs::path lidars = find_child(directory, {"LiDAR"});
  if (lidars.empty()) fail(directory, "holds no LiDAR/ directory");
  const HeliprSensor chosen = choose_sensor(lidars, options.sensor);
  const fs::path scans = lidars / helipr_directory(chosen);
  const auto files = list_files(scans, ".bin");
  if (files.empty()) fail(scans, "holds no *.bin scans");

  const fs::path truth_file = find_ground_truth(directory, chosen);
  std::vector<std::int64_t> stamps_ns;
  stamps_ns.reserve(files.size());
  for (const fs::path& file : files) stamps_ns.push_back(stamp_of(file));
  const Trajectory truth =
      parse_trajectory(read_text(truth_file), truth_file, StampUnit::kNanoseconds);
  return std::make_unique<HeliprDataset>(chosen,
                                         take_by_stamp(files, stamps_ns, truth, truth_file));
}

}  // namespace unimapper::datasets
