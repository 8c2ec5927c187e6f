// Cells of the schemas before range coding
#pragma once

#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

/// Reads a list of cells of schemas 1 to 3: whole centimetres, in blocks of 2.56 m. Null, or why
/// the bytes are none.
const char* read_plain_cells(LittleEndianReader& in, std::vector<FineCell>& cells);

}  // namespace unimapper::wire
