#include "site_frame.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "map_level.hpp"

namespace unimapper::merge {
namespace {

// A heading that positions know less well stays the map's; also the deviation it is held with.
constexpr double kHeadingSigmaRad = 0.5;
// Far more than positions leave open: the prior on what they do determine vanishes.
constexpr double kSiteSigmaM = 1000.0;

Pose shifted(const Pose& pose, const Eigen::Vector3d& by) {
  return pose * Pose(Eigen::Matrix3d::Identity(), by);
}

/// Weighted means of x and y where both are known, in the map and in the site.
struct HorizontalMeans {
  double weight = 0.0;
  Eigen::Vector2d in_map = Eigen::Vector2d::Zero();
  Eigen::Vector2d in_site = Eigen::Vector2d::Zero();
};

double horizontal_weight(const KnownPosition& position) {
  return position.is_horizontal() ? 1.0 / (position.sigma_xy_m * position.sigma_xy_m) : 0.0;
}

HorizontalMeans means_of(std::span<const KnownPosition> positions,
                         std::span<const Eigen::Vector3d> points) {
  HorizontalMeans means;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double weight = horizontal_weight(positions[i]);
    if (weight == 0.0) continue;
    means.weight += weight;
    means.in_map += weight * points[i].head<2>();
    means.in_site += weight * positions[i].position.head<2>();
  }
  if (means.weight > 0.0) {
    means.in_map /= means.weight;
    means.in_site /= means.weight;
  }
  return means;
}

Eigen::Vector3d centre_of(std::span<const KnownPosition> positions) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t horizontal = 0;
  for (const KnownPosition& position : positions) {
    sum.z() += position.position.z();
    if (!position.is_horizontal()) continue;
    sum.head<2>() += position.position.head<2>();
    ++horizontal;
  }
  sum.z() /= static_cast<double>(positions.size());
  sum.head<2>() /= static_cast<double>(std::max<std::size_t>(1, horizontal));
  return sum;
}

}  // namespace

SiteFit fit_site(const MapState& state, std::span<const KnownPosition> positions) {
  const Eigen::Vector3d up = state.T_map_session[state.central].rotation * state.up[state.central];
  const Eigen::Matrix3d level = rotation_to_z(up);
  std::vector<Eigen::Vector3d> points;
  points.reserve(positions.size());
  for (const KnownPosition& position : positions) {
    points.push_back(level * (state.T_map_keyframe(position.keyframe) * position.point));
  }
  const HorizontalMeans means = means_of(positions, points);
  SiteFit fit;
  double dot = 0.0;
  double cross = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double weight = horizontal_weight(positions[i]);
    if (weight == 0.0) continue;
    const Eigen::Vector2d m = points[i].head<2>() - means.in_map;
    const Eigen::Vector2d s = positions[i].position.head<2>() - means.in_site;
    fit.heading_information += weight * m.squaredNorm();
    dot += weight * m.dot(s);
    cross += weight * (m.x() * s.y() - m.y() * s.x());
  }
  const bool has_heading = fit.heading_information * kHeadingSigmaRad * kHeadingSigmaRad >= 1.0;
  const double heading = has_heading ? std::atan2(cross, dot) : 0.0;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Pose T_site_map(turn * level, Eigen::Vector3d::Zero());
  if (means.weight > 0.0) {
    T_site_map.translation.head<2>() = means.in_site - turn.topLeftCorner<2, 2>() * means.in_map;
  }
  double weights = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double weight = 1.0 / (positions[i].sigma_z_m * positions[i].sigma_z_m);
    weights += weight;
    T_site_map.translation.z() += weight * (positions[i].position.z() - points[i].z());
  }
  if (weights > 0.0) T_site_map.translation.z() /= weights;
  fit.T_map_site = T_site_map.inverse();
  return fit;
}

std::vector<KnownPosition> positions_of(const MapState& state,
                                        std::span<const std::size_t> sessions) {
  std::vector<KnownPosition> chosen;
  for (const KnownPosition& position : state.positions) {
    const bool is_of_them =
        std::find(sessions.begin(), sessions.end(), position.keyframe.session) != sessions.end();
    if (is_of_them) chosen.push_back(position);
  }
  return chosen;
}

Eigen::Vector3d position_residual(const MapState& state, const KnownPosition& position) {
  return state.T_map_site->inverse() * (state.T_map_keyframe(position.keyframe) * position.point) -
         position.position;
}

double position_chi2(const KnownPosition& position, const Eigen::Vector3d& residual,
                     double more_variance) {
  const double z =
      residual.z() * residual.z() / (position.sigma_z_m * position.sigma_z_m + more_variance);
  if (!position.is_horizontal()) return z;
  return z + residual.head<2>().squaredNorm() /
                 (position.sigma_xy_m * position.sigma_xy_m + more_variance);
}

SiteNode::SiteNode(const MapState& state, std::span<const std::size_t> sessions,
                   std::span<const std::size_t> first_node, double cauchy_scale, PoseGraph& graph) {
  const std::vector<KnownPosition> positions = positions_of(state, sessions);
  if (positions.empty()) return;
  // Coordinates may be large: about their centre, turns and shifts are apart.
  centre_ = centre_of(positions);
  const Pose T_map_centre = shifted(fit_site(state, positions).T_map_site, centre_);
  const std::size_t anchor = graph.anchors.size();
  graph.anchors.push_back({Pose{}, true});
  const std::size_t prior = graph.nodes.size();
  graph.nodes.push_back({T_map_centre, anchor, true});
  graph.nodes.push_back({T_map_centre, anchor, false});
  node_ = prior + 1;
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << kSiteSigmaM, kSiteSigmaM, kSiteSigmaM, kUpSigmaRad, kUpSigmaRad, kHeadingSigmaRad;
  const Matrix6d information = sigma.cwiseInverse().cwiseAbs2().asDiagonal();
  graph.edges.push_back({prior, *node_, Pose{}, information, 0.0});
  for (const KnownPosition& position : positions) {
    const double horizontal = position.is_horizontal() ? 1.0 / position.sigma_xy_m : 0.0;
    graph.positions.push_back({first_node[position.keyframe.session] + position.keyframe.keyframe,
                               *node_,
                               position.point,
                               position.position - centre_,
                               {horizontal, horizontal, 1.0 / position.sigma_z_m},
                               cauchy_scale});
  }
}

std::optional<Pose> SiteNode::T_map_site(const PoseGraph& graph) const {
  if (!node_) return std::nullopt;
  return shifted(graph.nodes[*node_].T_session_node, -centre_);
}

}  // namespace unimapper::merge
