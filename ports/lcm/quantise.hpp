// The grid on which keyframes travel.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/core/quantise.hpp"

namespace unimapper::wire {

/// Puts every cell, keypoint and plane of `record` on the wire's grid: cells and plane centres
/// to 1 cm within +-327 m, keypoints to 1 mm within +-1000 m, normals to 2 x 16 bits. What lies
/// beyond, or is not finite, is removed and counted in `record.left_out`. Cells are sorted.
/// Afterwards the record equals what the base will decode, bit for bit; doing it twice changes
/// nothing. Cost: O(n log n) in the cells.
void quantise(KeyframeRecord& record);

/// One cell as it travels, ordered as it travels: by 2.56 m block, ground before the rest, by
/// position, by points. From the top: block x y z (8 bits each, offset 128), not-ground (1),
/// x y z within the block in cm (8 each), points (8).
using CellKey = std::uint64_t;

/// Sorted keys of `cells`; those that cannot be represented are added to `left_out`.
std::vector<CellKey> cell_keys(std::span<const FineCell> cells, std::uint64_t& left_out);

/// The cell of a key.
FineCell cell_of(CellKey key);

}  // namespace unimapper::wire
