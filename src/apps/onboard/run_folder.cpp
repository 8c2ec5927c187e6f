#include "src/apps/onboard/run_folder.hpp"

#include <stdexcept>
#include <system_error>

#include "ports/datasets/files.hpp"
#include "ports/datasets/label_values.hpp"
#include "ports/datasets/writers.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

namespace {

/// The last named component, also for "runs/a/" and ".".
std::string own_name(const fs::path& directory) {
  fs::path path = fs::absolute(directory).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  return path.filename().string();
}

void remove_earlier_run(const fs::path& directory) {
  std::error_code ignored;
  for (const char* labels : {"labels", "final/labels"}) {
    if (!fs::exists(directory / labels)) continue;
    for (const fs::path& label : datasets::list_files(directory / labels, ".label")) {
      fs::remove(label, ignored);
    }
  }
  for (const char* name : {"keyframes.lcmlog", "loops.csv", "stats.json", "events.log"}) {
    fs::remove(directory / name, ignored);
  }
}

}  // namespace

RunFolder::RunFolder(const fs::path& directory, bool replaces)
    : directory_(directory), session_name_(wire::to_session_name(own_name(directory))) {
  const bool is_run = fs::exists(directory_ / "run.json");
  if (fs::exists(directory_ / "labels") && !is_run) {
    throw std::runtime_error(directory_.string() +
                             ": holds labels/ but no run.json, so it is not an earlier run; "
                             "choose another --out");
  }
  if (is_run && !replaces) {
    throw std::runtime_error(directory_.string() +
                             ": holds an earlier run; --replace overwrites it, or choose another "
                             "--out");
  }
  if (is_run) remove_earlier_run(directory_);
  datasets::make_directory(directory_ / "labels");
}

void RunFolder::write_labels(const std::string& name, std::span<const PointLabel> labels,
                             std::size_t points) {
  write(directory_ / "labels", name, labels, points);
}

void RunFolder::write_final_labels(const std::string& name, std::span<const PointLabel> labels,
                                   std::size_t points) {
  datasets::make_directory(directory_ / "final" / "labels");
  write(directory_ / "final" / "labels", name, labels, points);
}

void RunFolder::write(const fs::path& folder, const std::string& name,
                      std::span<const PointLabel> labels, std::size_t points) {
  buffer_.assign(points, datasets::kLabelStatic);
  const std::size_t known = std::min(points, labels.size());
  for (std::size_t i = 0; i < known; ++i) {
    if (labels[i] == PointLabel::kDynamic) buffer_[i] = datasets::kLabelDynamic;
  }
  datasets::write_labels(folder / (name + ".label"), buffer_);
}

void RunFolder::write_text(const std::string& name, const std::string& text) const {
  datasets::write_text(directory_ / name, text);
}

}  // namespace unimapper::apps
