// Parser of points in columns of text.
#pragma once

#include <filesystem>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Parses one point a line (XYZ, TXT, CSV, ASC): columns as a header names them (also behind `#` or
/// `//`), else x y z and, where there are exactly four, intensity. A first line with nothing but
/// the number of points is skipped. NaN points are kept. Throws DatasetError with the line.
void parse_xyz(std::string_view text, const std::filesystem::path& file, Scan& scan);

}  // namespace unimapper::datasets
