// STD loop search: triangle voting, pose hypotheses and plane overlap.
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "bench/places/point_tree.hpp"
#include "bench/places/std_baseline.hpp"
#include "bench/places/std_triangles.hpp"
#include "bench/places/std_voxels.hpp"

namespace unimapper::bench {

struct StdDatabase::Stored {
  StdPlace place;
  std::unique_ptr<PointTree> plane_centers;
};

struct StdDatabase::Entry {
  std::uint32_t place;
  StdTriangle triangle;
};

namespace {

using Corners = Eigen::Matrix3d;  ///< a triangle's vertices, one in each column
using Sides = Eigen::Vector3d;

struct Match {
  Corners query;
  Corners stored;
};

struct Candidate {
  std::uint32_t place = 0;
  std::uint32_t votes = 0;
};

Corners corners_of(const StdTriangle& triangle, const StdPlace& place) {
  Corners corners;
  for (std::size_t i = 0; i < 3; ++i) {
    corners.col(static_cast<Eigen::Index>(i)) = place.keypoints[triangle.vertices[i]].position;
  }
  return corners;
}

std::uint64_t key_of(const Eigen::Vector3i& cell) {
  std::uint64_t key = 0;
  for (const int side : cell) key = (key << 21U) + static_cast<std::uint64_t>(side);
  return key;
}

std::uint64_t insertion_key(const Sides& sides) {
  return key_of((sides + Sides::Constant(0.5)).cast<int>());
}

/// Calls `visit(key)` for the cells that may hold triangles like one with these sides. Insertion
/// rounds and this truncates, as STD does, so the range is asymmetric.
template <typename Visit>
void for_each_key(const Sides& sides, Visit visit) {
  for (int a = -1; a <= 1; ++a) {
    for (int b = -1; b <= 1; ++b) {
      for (int c = -1; c <= 1; ++c) {
        const Eigen::Vector3i cell = (sides + Sides(a, b, c)).cast<int>();
        const Sides center = cell.cast<double>() + Sides::Constant(0.5);
        if ((sides - center).norm() < 1.5) visit(key_of(cell));
      }
    }
  }
}

bool are_alike(const StdTriangle& query, const StdTriangle& stored, const StdConfig& config) {
  const double tolerance = config.side_tolerance * query.sides.norm();
  if ((query.sides - stored.sides).squaredNorm() >= tolerance * tolerance) return false;
  if (!config.tests_counts) return true;
  const double difference = 2.0 * (query.counts - stored.counts).norm();
  return difference < config.count_tolerance * (query.counts + stored.counts).norm();
}

/// Those with the most votes, most first.
std::vector<Candidate> select_candidates(const std::vector<std::uint32_t>& votes,
                                         const StdConfig& config) {
  std::vector<Candidate> candidates;
  for (std::uint32_t place = 0; place < votes.size(); ++place) {
    if (votes[place] >= config.min_votes) candidates.push_back({place, votes[place]});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
  candidates.resize(std::min<std::size_t>(candidates.size(), config.max_candidates));
  return candidates;
}

/// The pose that moves one triangle onto the other.
Pose pose_of(const Match& match) {
  const Eigen::Vector3d from = match.query.rowwise().mean();
  const Eigen::Vector3d to = match.stored.rowwise().mean();
  const Eigen::Matrix3d products =
      (match.query.colwise() - from) * (match.stored.colwise() - to).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d v = svd.matrixV();
  if ((v * svd.matrixU().transpose()).determinant() < 0.0) v.col(2) = -v.col(2);
  const Eigen::Matrix3d rotation = v * svd.matrixU().transpose();
  return {rotation, to - rotation * from};
}

std::size_t count_agreeing(const std::vector<Match>& matches, const Pose& T_match_query,
                           double agreement_m) {
  const double squared = agreement_m * agreement_m;
  const auto agrees = [&](const Match& match) {
    const Corners moved =
        (T_match_query.rotation * match.query).colwise() + T_match_query.translation;
    return (moved - match.stored).colwise().squaredNorm().maxCoeff() < squared;
  };
  return static_cast<std::size_t>(std::count_if(matches.begin(), matches.end(), agrees));
}

/// The pose of the triangle with which most others agree. STD does not refit it to all that agree.
std::optional<Pose> find_pose(const std::vector<Match>& matches, const StdConfig& config) {
  const std::size_t step = matches.size() / config.max_hypotheses + 1;
  std::size_t most = 0;
  std::optional<Pose> best;
  for (std::size_t i = 0; i + step <= matches.size(); i += step) {
    const Pose pose = pose_of(matches[i]);
    const std::size_t agreeing = count_agreeing(matches, pose, config.agreement_m);
    if (agreeing < config.min_agreeing || agreeing <= most) continue;
    most = agreeing;
    best = pose;
  }
  return best;
}

bool coincide(const StdPlane& query, const StdPlane& stored, const StdConfig& config) {
  return are_parallel(query.normal, stored.normal, config.overlap_normals) &&
         std::abs(stored.normal.dot(query.center - stored.center)) < config.overlap_distance_m;
}

/// Share of the query's planes that coincide with one of those nearest to them.
double overlap(const StdPlace& query, const StdPlace& stored, const PointTree& plane_centers,
               const Pose& T_match_query, const StdConfig& config) {
  if (query.planes.empty()) return 0.0;
  std::size_t found = 0;
  std::vector<std::uint32_t> nearest;
  for (const StdPlane& plane : query.planes) {
    const StdPlane moved{T_match_query * plane.center, T_match_query.rotation * plane.normal};
    plane_centers.nearest(moved.center, config.overlap_neighbours, nearest);
    const bool is_found = std::any_of(nearest.begin(), nearest.end(), [&](std::uint32_t number) {
      return coincide(moved, stored.planes[number], config);
    });
    if (is_found) ++found;
  }
  return static_cast<double>(found) / static_cast<double>(query.planes.size());
}

}  // namespace

StdDatabase::StdDatabase(const StdConfig& config) : config_(config) {}
StdDatabase::~StdDatabase() = default;
StdDatabase::StdDatabase(StdDatabase&&) noexcept = default;
StdDatabase& StdDatabase::operator=(StdDatabase&&) noexcept = default;

std::uint32_t StdDatabase::insert(StdPlace place) {
  const auto number = static_cast<std::uint32_t>(places_.size());
  const std::vector<StdTriangle> triangles = form_triangles(place.keypoints, config_);
  for (const StdTriangle& triangle : triangles) {
    cells_[insertion_key(triangle.sides)].push_back({number, triangle});
  }
  triangle_count_ += triangles.size();
  std::vector<Eigen::Vector3d> centers;
  centers.reserve(place.planes.size());
  for (const StdPlane& plane : place.planes) centers.push_back(plane.center);
  places_.push_back({std::move(place), std::make_unique<PointTree>(std::move(centers))});
  return number;
}

std::optional<StdLoop> StdDatabase::search(const StdPlace& query) const {
  const std::vector<StdTriangle> triangles = form_triangles(query.keypoints, config_);
  std::vector<std::pair<const StdTriangle*, const Entry*>> pairs;
  std::vector<std::uint32_t> votes(places_.size(), 0);
  for (const StdTriangle& triangle : triangles) {
    for_each_key(triangle.sides, [&](std::uint64_t key) {
      const auto cell = cells_.find(key);
      if (cell == cells_.end()) return;
      for (const Entry& entry : cell->second) {
        if (!are_alike(triangle, entry.triangle, config_)) continue;
        pairs.emplace_back(&triangle, &entry);
        ++votes[entry.place];
      }
    });
  }

  std::optional<StdLoop> best;
  std::vector<Match> matches;
  for (const Candidate& candidate : select_candidates(votes, config_)) {
    const Stored& stored = places_[candidate.place];
    matches.clear();
    for (const auto& [triangle, entry] : pairs) {
      if (entry->place != candidate.place) continue;
      matches.push_back({corners_of(*triangle, query), corners_of(entry->triangle, stored.place)});
    }
    const auto pose = find_pose(matches, config_);
    if (!pose) continue;
    const double score = overlap(query, stored.place, *stored.plane_centers, *pose, config_);
    if (!best || score > best->score) best = {candidate.place, score, candidate.votes, *pose};
  }
  return best;
}

}  // namespace unimapper::bench
