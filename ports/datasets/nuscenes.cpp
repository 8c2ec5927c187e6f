// Reader of nuScenes.
#include "ports/datasets/nuscenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/record_width.hpp"
#include "ports/datasets/sequence.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr std::string_view kLidar = "LIDAR_TOP";

/// The tables of one data set, parsed as they are needed.
class Tables {
 public:
  Tables(const NuScenesTable& table, const fs::path& folder) : table_(table), folder_(folder) {}

  /// Calls `consume` for every entry of a table. None is kept: the whole data set has millions.
  template <typename Consume>
  void for_each_entry(const std::string& name, const Consume& consume) const {
    const auto keep = [&](int depth, Json::parse_event_t event, Json& parsed) {
      const bool is_entry = depth == 1 && event == Json::parse_event_t::object_end;
      if (is_entry) consume(std::as_const(parsed));
      return !is_entry;
    };
    const Json json = Json::parse(table_(name), keep, false);
    if (!json.is_array()) fail(file(name), "is no JSON array");
  }

  [[nodiscard]] std::string text(const std::string& name, const Json& entry,
                                 const char* key) const {
    const auto found = entry.find(key);
    if (found == entry.end() || !found->is_string()) {
      fail(file(name), "an entry has no text \"" + std::string(key) + "\"");
    }
    return found->get<std::string>();
  }

  [[nodiscard]] std::int64_t stamp_ns(const std::string& name, const Json& entry) const {
    constexpr std::int64_t kMost_us = 9'000'000'000'000'000;
    const auto found = entry.find("timestamp");
    const bool fits = found != entry.end() && found->is_number() &&
                      std::abs(found->get<double>()) < static_cast<double>(kMost_us);
    if (!fits) fail(file(name), "an entry has no \"timestamp\" in microseconds");
    return found->get<std::int64_t>() * 1000;
  }

  /// rotation (w x y z) and translation of an entry.
  [[nodiscard]] Pose pose(const std::string& name, const Json& entry) const {
    const auto t = numbers<3>(name, entry, "translation");
    const auto q = numbers<4>(name, entry, "rotation");
    const auto pose = pose_from_quaternion(t[0], t[1], t[2], q[1], q[2], q[3], q[0]);
    if (!pose) fail(file(name), "an entry's rotation is no unit quaternion w x y z");
    return *pose;
  }

  [[nodiscard]] fs::path file(const std::string& name) const { return folder_ / (name + ".json"); }

 private:
  template <std::size_t kCount>
  [[nodiscard]] std::array<double, kCount> numbers(const std::string& name, const Json& entry,
                                                   const char* key) const {
    std::array<double, kCount> values{};
    const auto found = entry.find(key);
    const bool fits = found != entry.end() && found->is_array() && found->size() == kCount &&
                      std::all_of(found->begin(), found->end(),
                                  [](const Json& value) { return value.is_number(); });
    if (!fits) {
      fail(file(name), "an entry has no \"" + std::string(key) + "\" of " + std::to_string(kCount) +
                           " numbers");
    }
    for (std::size_t i = 0; i < kCount; ++i) values[i] = (*found)[i].template get<double>();
    return values;
  }

  const NuScenesTable& table_;
  const fs::path& folder_;
};

bool is_lidar_sweep(const Json& entry) {
  const auto name = entry.find("filename");
  return name != entry.end() && name->is_string() &&
         name->get_ref<const std::string&>().find(kLidar) != std::string::npos;
}

/// The pose of every entry of a table whose token is in `wanted`.
std::map<std::string, Pose> poses_by_token(const Tables& tables, const std::string& name,
                                           const std::set<std::string>& wanted) {
  std::map<std::string, Pose> poses;
  tables.for_each_entry(name, [&](const Json& entry) {
    const std::string token = tables.text(name, entry, "token");
    if (wanted.count(token) > 0) poses[token] = tables.pose(name, entry);
  });
  return poses;
}

std::set<std::string> samples_of(const Tables& tables, const std::string& scene) {
  std::string scene_token;
  tables.for_each_entry("scene", [&](const Json& entry) {
    if (tables.text("scene", entry, "name") != scene) return;
    scene_token = tables.text("scene", entry, "token");
  });
  std::set<std::string> samples;
  tables.for_each_entry("sample", [&](const Json& entry) {
    if (tables.text("sample", entry, "scene_token") != scene_token) return;
    samples.insert(tables.text("sample", entry, "token"));
  });
  if (samples.empty()) fail(tables.file("sample"), "has no sample of scene " + scene);
  return samples;
}

const Pose& pose_of(const std::map<std::string, Pose>& poses, const std::string& token,
                    const fs::path& file) {
  const auto found = poses.find(token);
  if (found == poses.end()) fail(file, "lacks the entry " + token + " that a sweep names");
  return found->second;
}

}  // namespace

std::vector<std::string> parse_nuscenes_scenes(const NuScenesTable& table, const fs::path& folder) {
  const Tables tables(table, folder);
  std::vector<std::string> names;
  tables.for_each_entry(
      "scene", [&](const Json& entry) { names.push_back(tables.text("scene", entry, "name")); });
  return names;
}

std::vector<NuScenesSweep> parse_nuscenes_sweeps(const NuScenesTable& table,
                                                 const std::string& name, const fs::path& folder) {
  const Tables tables(table, folder);
  const std::set<std::string> samples = samples_of(tables, name);
  struct Tokens {
    std::string ego;
    std::string calibration;
  };
  std::vector<NuScenesSweep> sweeps;
  std::vector<Tokens> tokens;
  std::set<std::string> egos;
  std::set<std::string> calibrations;
  tables.for_each_entry("sample_data", [&](const Json& entry) {
    if (!is_lidar_sweep(entry)) return;
    if (samples.count(tables.text("sample_data", entry, "sample_token")) == 0) return;
    tokens.push_back({tables.text("sample_data", entry, "ego_pose_token"),
                      tables.text("sample_data", entry, "calibrated_sensor_token")});
    egos.insert(tokens.back().ego);
    calibrations.insert(tokens.back().calibration);
    sweeps.push_back({tables.stamp_ns("sample_data", entry),
                      tables.text("sample_data", entry, "filename"), Pose()});
  });
  const auto vehicles = poses_by_token(tables, "ego_pose", egos);
  const auto mounts = poses_by_token(tables, "calibrated_sensor", calibrations);
  for (std::size_t i = 0; i < sweeps.size(); ++i) {
    sweeps[i].T_global_lidar =
        pose_of(vehicles, tokens[i].ego, tables.file("ego_pose")) *
        pose_of(mounts, tokens[i].calibration, tables.file("calibrated_sensor"));
  }
  std::sort(sweeps.begin(), sweeps.end(),
            [](const NuScenesSweep& a, const NuScenesSweep& b) { return a.stamp_ns < b.stamp_ns; });
  return sweeps;
}

namespace {

/// The folder of the tables, e.g. v1.0-mini; empty if none.
fs::path find_tables(const fs::path& directory) {
  for (const fs::path& child : list_directories(directory)) {
    if (child.filename().string().starts_with("v1.0-") && fs::exists(child / "sample_data.json")) {
      return child;
    }
  }
  return {};
}

std::string choose_scene(const std::vector<std::string>& scenes, const fs::path& tables,
                         const std::string& wanted) {
  std::string names;
  for (const std::string& name : scenes) {
    if (name == wanted || name == "scene-" + wanted) return name;
    names += (names.empty() ? "" : ", ") + name;
  }
  if (wanted.empty() && scenes.size() == 1) return scenes.front();
  fail(tables / "scene.json", "choose a scene with --sequence: there are " + names);
}

class NuScenesDataset : public SequenceDataset {
 public:
  NuScenesDataset(Sequence sequence, RecordLayout layout)
      : SequenceDataset(std::move(sequence)), layout_(std::move(layout)) {}

  void read_scan(std::size_t i, Scan& scan) const override { read_records(file(i), layout_, scan); }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return stem_of(file(i)); }
  /// nuScenes' cars carry an HDL-32E.
  [[nodiscard]] std::string sensor() const override {
    const SensorModel* model = find_sensor("hdl-32e");
    return model == nullptr ? std::string() : std::string(model->name);
  }

 private:
  RecordLayout layout_;
};

}  // namespace

bool recognises_nuscenes(const fs::path& directory) {
  std::error_code error;
  return fs::is_directory(directory, error) && !find_tables(directory).empty();
}

std::unique_ptr<Dataset> open_nuscenes(const fs::path& directory, const OpenOptions& options) {
  const fs::path tables = find_tables(directory);
  if (tables.empty()) fail(directory, "holds no v1.0-*/sample_data.json");
  const NuScenesTable table = [&](std::string_view name) {
    return read_file(tables / (std::string(name) + ".json"));
  };
  const std::string scene =
      choose_scene(parse_nuscenes_scenes(table, tables), tables, options.sequence);
  Sequence sequence;
  std::size_t missing = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (NuScenesSweep& sweep : parse_nuscenes_sweeps(table, scene, tables)) {
    const fs::path file = directory / fs::path(sweep.file).relative_path();
    if (!fs::exists(file)) {
      ++missing;
      continue;
    }
    if (sequence.files.empty()) origin = sweep.T_global_lidar.translation;
    sweep.T_global_lidar.translation -= origin;
    sequence.files.push_back(file);
    sequence.poses.push_back(sweep.T_global_lidar);
    sequence.stamps_ns.push_back(sweep.stamp_ns);
  }
  if (sequence.files.empty()) fail(directory, "holds none of the sweeps of " + scene);
  sequence.notes.push_back({scene});
  if (missing > 0) {
    sequence.notes.push_back(
        {std::to_string(missing) + " sweeps of " + scene + " are not there", true});
  }
  RecordLayout layout = find_record_layout(sequence.files, options.point_fields, sequence.notes);
  return std::make_unique<NuScenesDataset>(std::move(sequence), std::move(layout));
}

}  // namespace unimapper::datasets
