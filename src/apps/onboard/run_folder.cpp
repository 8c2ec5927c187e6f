#include "src/apps/onboard/run_folder.hpp"

#include <algorithm>

#include "ports/datasets/label_values.hpp"
#include "ports/datasets/writers.hpp"
#include "src/apps/output_guard.hpp"
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

}  // namespace

RunFolder::RunFolder(const fs::path& directory)
    : directory_(directory), session_name_(wire::to_session_name(own_name(directory))) {
  remove_earlier_output(directory_, Output::kRun);
  datasets::make_directory(directory_ / "labels");
}

void RunFolder::write_labels(const std::string& name, std::span<const PointLabel> labels,
                             std::size_t points) {
  write(directory_ / "labels", name, labels, points);
}

void RunFolder::write_final_labels(const std::string& name, std::span<const PointLabel> labels,
                                   std::size_t points) {
  write(directory_ / "final" / "labels", name, labels, points);
}

void RunFolder::write(const fs::path& folder, const std::string& name,
                      std::span<const PointLabel> labels, std::size_t points) {
  buffer_.assign(points, datasets::kLabelStatic);
  const std::size_t known = std::min(points, labels.size());
  for (std::size_t i = 0; i < known; ++i) {
    if (labels[i] == PointLabel::kDynamic) buffer_[i] = datasets::kLabelDynamic;
  }
  const fs::path file = folder / (name + ".label");
  write_whole(file, [this, &folder, &file] {
    datasets::make_directory(folder);
    datasets::write_labels(file, buffer_);
  });
}

void RunFolder::write_text(const std::string& name, const std::string& text) {
  const fs::path file = directory_ / name;
  write_whole(file, [&file, &text] { datasets::write_text(file, text); });
}

void RunFolder::write_whole(const fs::path& file, const std::function<void()>& write) {
  if (failures_.attempt(write)) return;
  std::error_code ignored;
  fs::remove(file, ignored);
}

}  // namespace unimapper::apps
