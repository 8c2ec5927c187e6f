// Data of the plots that show what failed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

/// Two keyframes one of which should have been found by the other, or was by mistake, seen from
/// above: what they show and their keypoints.
struct FailurePicture {
  std::string title;
  std::string csv;
};

/// The surest false loops and the best seen misses, of every row one of each at most, `most` of
/// each in all. `rows` are those of `pairs`, described as the default describes.
[[nodiscard]] std::vector<FailurePicture> worst_failures(const std::vector<DrivePair>& pairs,
                                                         const std::vector<PairRow>& rows,
                                                         std::size_t most);

/// As worst-N.title and worst-N.csv, N counting from 0: what (0 column of the match, 1 its
/// keypoint, 2 and 3 the same of the query where it was, 4 and 5 where the answer puts it), x, y in
/// metres from the match, along the axes of the world.
void write_failure_pictures(const std::filesystem::path& folder,
                            const std::vector<FailurePicture>& pictures);

}  // namespace unimapper::bench
