// Memory of the prepared configurations, as Markdown
//
// Megabytes are 10^6 bytes, rounded up: what is asked for is there.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "src/onboard/keyframe/keyframe_builder.hpp"
#include "src/onboard/keyframe/keyframe_finisher.hpp"
#include "src/onboard/removal/dynamic_removal.hpp"
#include "src/onboard/removal/evidence_window.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace {

using namespace unimapper;

struct Prepared {
  const char* name;
  Computer computer;
};

constexpr Prepared kComputers[] = {{"server (`default`)", Computer::kServer},
                                   {"Jetson class (`jetson`)", Computer::kJetson},
                                   {"Raspberry Pi class (`raspberry-pi`)", Computer::kRaspberryPi},
                                   {"ARMv7, 64 MB (`armv7-64mb`)", Computer::kArmv7With64Mb}};

struct Lidar {
  const char* name;
  SensorKind kind;
};

constexpr Lidar kLidars[] = {{"OS2-128", SensorKind::kOs2_128},    {"OS1-64", SensorKind::kOs1_64},
                             {"HDL-64E", SensorKind::kHdl64e},     {"VLP-16", SensorKind::kVlp16},
                             {"Aeva", SensorKind::kAevaAeries2},   {"Avia", SensorKind::kLivoxAvia},
                             {"Mid-360", SensorKind::kLivoxMid360}};

double megabytes(const PipelineConfig& config) {
  return std::ceil(static_cast<double>(Pipeline::required_bytes(config)) / 1e6);
}

/// A row per computer: memory by LiDAR, and the limits that make the difference (OS2-128).
void print_presets() {
  std::printf("| computer, MB |");
  for (const Lidar& lidar : kLidars) std::printf(" %s |", lidar.name);
  std::printf(" places | range m | cells a keyframe |\n|---|");
  for (std::size_t i = 0; i < std::size(kLidars) + 3; ++i) std::printf("---|");
  std::printf("\n");
  for (const Prepared& prepared : kComputers) {
    std::printf("| %s |", prepared.name);
    for (const Lidar& lidar : kLidars) {
      std::printf(" %.0f |", megabytes(preset(lidar.kind, prepared.computer)));
    }
    const PipelineConfig config = preset(SensorKind::kOs2_128, prepared.computer);
    std::printf(" %zu | %.0f | %zu |\n", std::size_t{config.loop_search.max_places},
                static_cast<double>(config.keyframe.range_max_m),
                std::size_t{config.voxel.max_cells});
  }
}

/// What halving a parameter of the OS2-128's default saves.
void print_parameters() {
  const PipelineConfig all = preset(SensorKind::kOs2_128);
  const auto row = [&](const char* what, auto value, auto half, const PipelineConfig& less,
                       const char* cost) {
    std::printf("| %s | %zu to %zu | %.0f | %s |\n", what, std::size_t{value}, std::size_t{half},
                megabytes(all) - megabytes(less), cost);
  };
  std::printf("| parameter | halved | saves MB of %.0f | what it costs |\n|---|---|---|---|\n",
              megabytes(all));
  PipelineConfig less = all;
  less.loop_search.max_places /= 2;
  row("`loop_search.max_places`", all.loop_search.max_places, less.loop_search.max_places, less,
      "how far back loops are found; nothing for labels");
  less = all;
  less.removal.window /= 2;
  row("`removal.window`", all.removal.window, less.removal.window, less,
      "evidence of earlier keyframes");
  less = all;
  less.voxel.max_cells /= 2;
  row("`voxel.max_cells`, after `keyframe.range_max_m`", all.voxel.max_cells, less.voxel.max_cells,
      less, "far cells");
  less = all;
  less.keyframe.max_points_per_scan /= 2;
  row("`keyframe.max_points_per_scan`", all.keyframe.max_points_per_scan,
      less.keyframe.max_points_per_scan, less, "only if the sensor never sends as many");
}

template <typename Allocate>
std::size_t bytes_of(const Allocate& allocate) {
  Arena arena = Arena::measuring();
  allocate(arena);
  return arena.used();
}

struct MemoryPart {
  const char* name;
  std::size_t bytes;
};

std::vector<MemoryPart> parts_of(const PipelineConfig& config) {
  PlaceDatabase places;
  onboard::EvidenceWindow window;
  onboard::FinalLabels labels;
  onboard::KeyframeBuilder builder(config);
  onboard::DynamicRemoval removal(config);
  onboard::KeyframeFinisher finisher(config);
  std::vector<MemoryPart> parts{
      {"places: planes, keypoints, triangles", bytes_of([&](Arena& arena) {
         places.allocate_kept(arena, config.loop_search, config.place_shape());
       })},
      {"window: blocks, range images",
       bytes_of([&](Arena& arena) { window.allocate(arena, config); })},
      {"table of the cells; later description and search",
       std::max(bytes_of([&](Arena& arena) { removal.allocate_table(arena); }),
                bytes_of([&](Arena& arena) { finisher.allocate_scratch(arena); }))},
      {"undecided cells, for final labels",
       bytes_of([&](Arena& arena) { labels.allocate(arena, config); })},
      {"points of the open keyframe, codes",
       bytes_of([&](Arena& arena) { builder.allocate(arena, config); })},
      {"log-odds", bytes_of([&](Arena& arena) { removal.allocate(arena); })}};
  std::size_t rest = Pipeline::required_bytes(config);
  for (const MemoryPart& part : parts) rest -= part.bytes;
  parts.insert(parts.begin() + 2, {"sums of cells; later voxels, components, labels", rest});
  return parts;
}

/// What takes the memory of the default configuration.
void print_parts() {
  const std::vector<MemoryPart> os2 = parts_of(preset(SensorKind::kOs2_128));
  const std::vector<MemoryPart> hdl = parts_of(preset(SensorKind::kHdl64e));
  const std::vector<MemoryPart> vlp = parts_of(preset(SensorKind::kVlp16));
  std::printf("| MB of `default` | OS2-128 | HDL-64E | VLP-16 |\n|---|---|---|---|\n");
  for (std::size_t i = 0; i < os2.size(); ++i) {
    const auto megabytes_in = [&](const std::vector<MemoryPart>& parts) {
      return static_cast<double>(parts[i].bytes) / 1e6;
    };
    std::printf("| %s | %.1f | %.1f | %.1f |\n", os2[i].name, megabytes_in(os2), megabytes_in(hdl),
                megabytes_in(vlp));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Memory of the prepared configurations, as a Markdown table."};
  std::string table;
  app.add_option(
         "TABLE", table,
         "presets: by computer and LiDAR; parts: what takes it; parameters: what halving one "
         "saves")
      ->required()
      ->check(CLI::IsMember({"presets", "parts", "parameters"}));
  CLI11_PARSE(app, argc, argv);
  if (table == "presets") {
    print_presets();
  } else if (table == "parts") {
    print_parts();
  } else {
    print_parameters();
  }
  return 0;
}
