#include "ports/datasets/dataset.hpp"

#include "ports/datasets/files.hpp"
#include "ports/datasets/readers.hpp"

namespace unimapper::datasets {

std::unique_ptr<Dataset> open_dataset(const std::filesystem::path& path,
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

}  // namespace unimapper::datasets
