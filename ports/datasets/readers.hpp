// List of readers of recordings.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// A form in which recordings come.
struct Reader {
  std::string_view name;         ///< for --format
  std::string_view description;  ///< what has to be there, one line
  /// True where `path` looks like this form: by names, sizes and first bytes, not by all content.
  /// Throws DatasetError for an unreadable folder.
  bool (*recognises)(const std::filesystem::path& path);
  /// Throws DatasetError.
  std::unique_ptr<Dataset> (*open)(const std::filesystem::path& path, const OpenOptions& options);
};

/// All readers, in the order in which they are asked. A new reader is one file and one row here.
[[nodiscard]] std::span<const Reader> readers();

/// The reader of that name; null if there is none.
[[nodiscard]] const Reader* find_reader(std::string_view name);

/// The first reader that recognises `path`. Throws DatasetError where none does, with what is
/// expected.
[[nodiscard]] const Reader& recognise(const std::filesystem::path& path);

/// "auto, kitti, pcd, ...": the choices of --format.
[[nodiscard]] std::string format_names();

}  // namespace unimapper::datasets
