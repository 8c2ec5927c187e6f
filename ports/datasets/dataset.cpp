#include "ports/datasets/dataset.hpp"

#include <algorithm>
#include <utility>

#include "ports/datasets/deskew.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/mounting.hpp"
#include "ports/datasets/readers.hpp"

namespace unimapper::datasets {

namespace {

std::unique_ptr<Dataset> open_with_reader(const std::filesystem::path& path,
                                          const OpenOptions& options) {
  if (options.format == "auto") return recognise(path).open(path, options);
  const Reader* reader = find_reader(options.format);
  if (reader == nullptr) {
    throw DatasetError("--format: unknown format '" + options.format + "'; there are " +
                       format_names());
  }
  std::error_code error;
  if (!std::filesystem::exists(path, error)) fail(path, "no such file or directory");
  return reader->open(path, options);
}

/// One LiDAR's scans.
std::unique_ptr<Dataset> open_lidar(const std::filesystem::path& path, const OpenOptions& options) {
  std::unique_ptr<Dataset> dataset = open_with_reader(path, options);
  if (options.T_base_lidar) dataset = mounted(std::move(dataset), *options.T_base_lidar);
  return deskewed(std::move(dataset), options.deskew);
}

}  // namespace

std::unique_ptr<Dataset> open_dataset(const std::filesystem::path& path,
                                      const OpenOptions& options) {
  std::vector<std::unique_ptr<Dataset>> lidars;
  for (std::size_t begin = 0; begin <= options.topic.size();) {
    const std::size_t end = std::min(options.topic.find(',', begin), options.topic.size());
    OpenOptions one = options;
    one.topic = options.topic.substr(begin, end - begin);
    lidars.push_back(open_lidar(path, one));
    begin = end + 1;
  }
  return several_lidars(std::move(lidars));
}

}  // namespace unimapper::datasets
