#include "src/apps/output_guard.hpp"

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "ports/datasets/files.hpp"
#include "ports/store/store_file.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

namespace {

/// Files of one extension in a folder.
struct Series {
  const char* folder;
  const char* extension;
};

/// How an output is told, and what it consists of.
struct Kind {
  Output output;
  const char* name;
  const char* marker;     ///< the file that tells it
  std::string_view says;  ///< what it must hold
  std::vector<const char*> files;
  std::vector<Series> series;
};

const std::array<Kind, 4>& kinds() {
  static const std::array<Kind, 4> all = {{
      {Output::kRun,
       "run",
       "run.json",
       "",
       {"keyframes.lcmlog", "loops.csv", "stats.json", "events.log", "run.json", "positions.csv"},
       {{"labels", ".label"}, {"final/labels", ".label"}}},
      {Output::kMap,
       "map",
       "map.ply",
       "",
       {"map.ply", "map.las", "changes.ply", "changes.json", "removed.ply", "grid.pgm", "grid.yaml",
        "graph.g2o", "loops.csv", "summary.json", "georeference.json", "timing.json",
        "report.html"},
       {{"trajectories", ".tum"},
        {"unconnected", ".tum"},
        {"clouds", ".ply"},
        {"tiles", ".ply"},
        {"tiles", ".las"},
        {"view", ".json"},
        {"view/static", ".gz"},
        {"view/removed", ".gz"},
        {"view/changes", ".gz"},
        {"view/false_static", ".gz"},
        {"view/false_dynamic", ".gz"},
        {"view/keyframe", ".gz"}}},
      {Output::kRecording,
       "simulated recording",
       "dataset.json",
       "unimapper-simulation",
       {"poses.txt", "gt_poses.txt", "times.txt", "motion.txt", "objects.txt", "dataset.json",
        "drive.mcap", "drive.bag"},
       {{"scans", ".bin"}, {"labels", ".label"}, {"drive", ".db3"}}},
      {Output::kPictures,
       "set of pictures",
       "worst.json",
       "",
       {"top_view.png", "worst.md", "worst.json"},
       {}},
  }};
  return all;
}

const Kind& kind_of(Output output) {
  for (const Kind& kind : kinds()) {
    if (kind.output == output) return kind;
  }
  throw std::logic_error("an output of no kind");
}

/// Whether a path is that of a refined label: refined/SESSION/labels/NAME.label.
bool is_refined_label(const fs::path& relative) {
  const std::vector<fs::path> parts(relative.begin(), relative.end());
  return parts.size() == 4 && parts[0] == "refined" && parts[2] == "labels" &&
         relative.extension() == ".label";
}

bool holds(const fs::path& folder, const Kind& kind) {
  const fs::path marker = folder / kind.marker;
  if (kind.says.empty() || !fs::exists(marker)) return fs::exists(marker);
  return datasets::read_file(marker).find(kind.says) != std::string::npos;
}

void remove_series(const fs::path& folder, const char* extension) {
  if (!fs::is_directory(folder)) return;
  std::error_code ignored;
  for (const fs::path& file : datasets::list_files(folder, extension)) fs::remove(file, ignored);
}

/// Files that the marker does not account for, and that this output would overwrite.
const char* foreign_content(const fs::path& folder, Output output) {
  const bool writes_labels = output == Output::kRun || output == Output::kRecording;
  const fs::path labels = folder / "labels";
  if (writes_labels && fs::exists(labels) && !fs::is_empty(labels)) return "labels/";
  if (output != Output::kRecording) return nullptr;
  for (const char* name : {"scans", "velodyne", "poses.txt", "drive.mcap", "drive.bag", "drive"}) {
    if (fs::exists(folder / name)) return name;
  }
  return nullptr;
}

/// Whether several numbered files of a format of scans lie in the folder.
bool holds_scans(const fs::path& folder) {
  constexpr int kSeveral = 3;
  int count = 0;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string stem = entry.path().stem().string();
    if (stem.empty() || stem.back() < '0' || stem.back() > '9') continue;
    const std::string extension = entry.path().extension().string();
    for (const std::string_view one : {".bin", ".pcd", ".ply"}) {
      count += extension == one && entry.is_regular_file(ignored) ? 1 : 0;
    }
    if (count >= kSeveral) return true;
  }
  return false;
}

/// The folder of the recording's scans that `out` is, lies in, or holds; empty if there is none.
fs::path scans_at(const fs::path& dataset, const fs::path& out) {
  std::error_code ignored;
  // The recording may hold its scans by a link.
  for (const fs::directory_entry& entry : fs::directory_iterator(dataset, ignored)) {
    if (fs::equivalent(entry.path(), out, ignored) && holds_scans(out)) return entry.path();
  }
  // `out` may be a link into the recording.
  const fs::path inside = fs::weakly_canonical(fs::absolute(out), ignored)
                              .lexically_relative(fs::canonical(dataset, ignored));
  if (inside.empty() || *inside.begin() == ".." || *inside.begin() == ".") return {};
  fs::path folder = dataset;
  for (const fs::path& part : inside) {
    folder /= part;
    if (holds_scans(folder)) return folder;
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(out, ignored)) {
    if (entry.is_directory(ignored) && holds_scans(entry.path())) return entry.path();
  }
  return {};
}

}  // namespace

void check_output_folder(const fs::path& folder, Output output, bool replaces) {
  const std::string choose =
      std::string("choose another ") + (output == Output::kPictures ? "--pictures" : "--out");
  if (fs::exists(folder / store::kDatabaseName)) {
    throw std::runtime_error(folder.string() + ": holds a store; " + choose);
  }
  bool is_earlier = false;
  for (const Kind& kind : kinds()) {
    if (!holds(folder, kind)) continue;
    if (kind.output == output) {
      is_earlier = true;
      if (replaces) continue;
      throw std::runtime_error(folder.string() + ": holds an earlier " + kind.name +
                               "; --replace overwrites it, or " + choose);
    }
    if (output == Output::kPictures || kind.output == Output::kPictures) continue;
    throw std::runtime_error(folder.string() + ": holds a " + kind.name +
                             ", which this would spoil; " + choose);
  }
  if (is_earlier) return;
  if (const char* content = foreign_content(folder, output)) {
    throw std::runtime_error(folder.string() + ": holds " + content +
                             " of unknown origin, perhaps a recording of yours; " + choose);
  }
}

void check_outside_recording(const fs::path& folder, const fs::path& dataset) {
  std::error_code ignored;
  if (fs::equivalent(dataset, folder, ignored)) {
    throw std::runtime_error(folder.string() + ": is the recording itself; choose another --out");
  }
  const fs::path scans = scans_at(dataset, folder);
  if (scans.empty()) return;
  throw std::runtime_error(folder.string() + ": the recording has scans in " + scans.string() +
                           "; choose another --out");
}

void check_output_file(const fs::path& file, bool replaces) {
  if (!fs::exists(file)) return;
  // A renamed file would take the place of a device.
  if (!fs::is_regular_file(file)) throw std::runtime_error(file.string() + ": is not a file");
  if (replaces) return;
  throw std::runtime_error(file.string() +
                           ": exists; --replace overwrites it, or choose another file");
}

void remove_earlier_output(const fs::path& folder, Output output) {
  std::error_code ignored;
  const Kind& kind = kind_of(output);
  if (!holds(folder, kind)) return;
  for (const Series& series : kind.series) remove_series(folder / series.folder, series.extension);
  for (const char* name : kind.files) fs::remove(folder / name, ignored);
}

bool holds_output(const fs::path& folder, Output output) { return holds(folder, kind_of(output)); }

bool is_output_file(const fs::path& relative, Output output) {
  const Kind& kind = kind_of(output);
  for (const char* name : kind.files) {
    if (relative == name) return true;
  }
  for (const Series& series : kind.series) {
    if (relative.parent_path() == series.folder && relative.extension() == series.extension) {
      return true;
    }
  }
  return output == Output::kMap && is_refined_label(relative);
}

bool is_output_folder(const fs::path& name, Output output) {
  for (const Series& series : kind_of(output).series) {
    if (*fs::path(series.folder).begin() == name) return true;
  }
  return output == Output::kMap && name == "refined";
}

}  // namespace unimapper::apps
