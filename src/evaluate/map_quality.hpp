// Quality of merged maps: AC, CD and MME (paper section VII-B).
//
// The paper's formulas contradict its text three times, so every reading has its own figure:
// "mean Euclidean distance" is printed as a root mean square (both are given), the Chamfer
// distance is printed with squared distances but tabulated in metres (both are given), and the
// entropy's determinant is missing (it is taken).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace unimapper::evaluate {

/// Agreement of two overlapping clouds. NaN where no point has a neighbour.
struct CloudAgreement {
  double ac_rmse_m = std::numeric_limits<double>::quiet_NaN();  ///< as the paper's formula
  double ac_mean_m = std::numeric_limits<double>::quiet_NaN();  ///< as the paper's text
  double cd_l2_m = std::numeric_limits<double>::quiet_NaN();    ///< sum of both mean distances
  double cd_l2_squared_m2 = std::numeric_limits<double>::quiet_NaN();  ///< of squared distances
  std::size_t inliers_first = 0;   ///< points of the first cloud with a neighbour within tau
  std::size_t inliers_second = 0;  ///< points of the second cloud with a neighbour within tau
};

/// Nearest-neighbour distances below `tau_m` in both directions. AC pools both directions.
/// O(n log n); builds two kd-trees.
[[nodiscard]] CloudAgreement compare_clouds(std::span<const Eigen::Vector3f> first,
                                            std::span<const Eigen::Vector3f> second, double tau_m);

/// Nearest-neighbour distances below each threshold in both directions, from one search. It takes
/// at most `max_queries` points of either cloud, evenly strided.
[[nodiscard]] std::vector<CloudAgreement> compare_clouds(std::span<const Eigen::Vector3f> first,
                                                         std::span<const Eigen::Vector3f> second,
                                                         std::span<const double> taus_m,
                                                         std::size_t max_queries);

/// Parameters of the mean map entropy.
struct EntropyConfig {
  double radius_m = 1.0;              ///< neighbourhood; the paper takes 5 m
  std::size_t min_neighbours = 10;    ///< including the point itself
  std::size_t max_queries = 200'000;  ///< evenly strided through the cloud
};

/// Mean map entropy.
struct MapEntropy {
  /// Over all queries, nats; NaN if there is none.
  double mean = std::numeric_limits<double>::quiet_NaN();
  std::size_t points = 0;   ///< points that went into the mean
  std::size_t skipped = 0;  ///< too few neighbours, or all in one plane to the last bit
};

/// Mean of 1/2 ln |2 pi e Sigma| over the points' neighbourhoods, Sigma the sample covariance
/// in square metres. It depends on radius and density: compare only equal voxel sizes.
[[nodiscard]] MapEntropy map_entropy(std::span<const Eigen::Vector3f> cloud,
                                     const EntropyConfig& config);

}  // namespace unimapper::evaluate
