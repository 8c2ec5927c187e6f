// Pictures of kept and removed points.
#pragma once

#include <cstddef>
#include <filesystem>

#include "src/apps/evaluate/labelled_run.hpp"

namespace unimapper::apps {

/// Writes top_view.png of all scans, and of the `worst` frames a range image, a view from above and
/// their table (worst.md, worst.json). Throws DatasetError where a file cannot be written.
void write_pictures(LabelledRun& run, const std::filesystem::path& directory, std::size_t worst);

}  // namespace unimapper::apps
