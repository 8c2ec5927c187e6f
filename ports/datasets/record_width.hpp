// Size of point records without a header, found from their content.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/point_fields.hpp"

namespace unimapper::datasets {

/// The layout of the *.bin `files`: as `point_fields` says (see `parse_point_fields`); five floats
/// for nuScenes' *.pcd.bin; else 4, 5 or 6 float32, whichever divides all sizes and makes the
/// columns differ most from each other: with a wrong size every column is a mixture of all. What is
/// not four floats is noted. Throws DatasetError where sizes fit none, where two fit alike, or
/// where the values are no coordinates, with the remedy.
[[nodiscard]] RecordLayout find_record_layout(const std::vector<std::filesystem::path>& files,
                                              const std::string& point_fields,
                                              std::vector<Note>& notes);

}  // namespace unimapper::datasets
