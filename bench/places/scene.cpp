#include "bench/places/scene.hpp"

#include <algorithm>
#include <stdexcept>

#include "src/merge/parallel.hpp"

namespace unimapper::bench {
namespace {

void compute_views(SceneDrive& drive) {
  for (const PlaceKeyframe& keyframe : drive.drive.keyframes) {
    drive.views.push_back(view_voxels(keyframe.static_cells, keyframe.T_world_keyframe));
    drive.columns.emplace_back(keyframe.static_cells, keyframe.T_world_keyframe, 0.5);
    drive.narrow_columns.emplace_back(keyframe.static_cells, keyframe.T_world_keyframe, 0.3);
  }
}

void describe_all(SceneDrive& drive, const std::vector<Variant>& variants) {
  for (const Variant& variant : variants) {
    if (variant.described_as != drive.described.size()) continue;
    drive.described.push_back(describe(drive.drive, variant.config, variant.description));
  }
}

void read_std(SceneDrive& drive, const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return;
  drive.std_described = read_std_file(file);
  if (drive.std_described.size() != drive.drive.keyframes.size()) {
    throw std::runtime_error(file.string() + ": belongs to another run");
  }
}

}  // namespace

const SceneDrive* Scene::find(const std::string& sensor, const std::string& route) const {
  const auto found = std::find_if(drives.begin(), drives.end(), [&](const SceneDrive& drive) {
    return drive.sensor == sensor && drive.route == route;
  });
  return found == drives.end() ? nullptr : &*found;
}

Scene read_scene(const std::filesystem::path& folder, const std::vector<std::string>& sensors,
                 const std::vector<std::string>& routes, const std::vector<Variant>& variants,
                 bool with_std) {
  Scene scene;
  scene.name = folder.filename().string();
  for (const std::string& sensor : sensors) {
    for (const std::string& route : routes) {
      const std::string name = std::string(sensor).append("-").append(route);
      if (!std::filesystem::exists(folder / name / "keyframes.lcmlog")) continue;
      scene.drives.emplace_back();
      scene.drives.back().sensor = sensor;
      scene.drives.back().route = route;
    }
  }
  merge::parallel_for(scene.drives.size(), 0, [&](std::size_t i) {
    SceneDrive& drive = scene.drives[i];
    const std::filesystem::path run = folder / (drive.sensor + "-" + drive.route);
    drive.drive = read_drive(run);
    compute_views(drive);
    describe_all(drive, variants);
    release_cells(drive.drive);
    if (with_std) read_std(drive, run / "std.places");
  });
  return scene;
}

}  // namespace unimapper::bench
