// Parser of PLY files.
#pragma once

#include <filesystem>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Parses the vertices of a whole file, ascii or binary of either byte order: x, y and z of any
/// type, and intensity, ring and time where a property is called so (`role_of`). The vertices are
/// the first element and have no lists; what follows them is not read. NaN points are kept. `file`
/// names the bytes in errors. Throws DatasetError with offset or line. Never allocates more than a
/// small multiple of `bytes`.
void parse_ply(std::string_view bytes, const std::filesystem::path& file, Scan& scan);

}  // namespace unimapper::datasets
