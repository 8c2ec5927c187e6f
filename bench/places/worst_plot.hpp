// Plot data of false and missed loops.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// Top view of the two keyframes of a false or missed loop: occupied columns and keypoints.
struct FailurePicture {
  std::string title;
  std::string csv;
};

/// The false loops of highest confidence and the missed ones of largest common view: at most one of
/// each per row and `most` of each in all. `rows` are those of `pairs` with the default
/// descriptors.
[[nodiscard]] std::vector<FailurePicture> worst_failures(const std::vector<DrivePair>& pairs,
                                                         const std::vector<PairRow>& rows,
                                                         std::size_t most);

/// As worst-N.title and worst-N.csv, N counting from 0: what (0 column of the match, 1 its
/// keypoint, 2 and 3 the same of the query at its true pose, 4 and 5 at the estimated pose), x, y
/// in metres from the match, along the axes of the world.
void write_failure_pictures(const std::filesystem::path& folder,
                            const std::vector<FailurePicture>& pictures);

}  // namespace unimapper::bench
