// Reader of published pose graphs, weighted as in SE-Sync.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge::testing {

/// Every edge gets the isotropic weights kappa and tau of its information matrix, so that the
/// cost is the SE-Sync objective and can be compared with certified optima.
inline PoseGraph read_g2o(const std::filesystem::path& path) {
  PoseGraph graph;
  graph.anchors.push_back({Pose{}, true});
  std::map<std::uint64_t, std::size_t> ids;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    const auto read_pose = [&words] {
      double x, y, z, qx, qy, qz, qw;
      words >> x >> y >> z >> qx >> qy >> qz >> qw;
      return Pose(Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(x, y, z));
    };
    if (tag == "VERTEX_SE3:QUAT") {
      std::uint64_t id;
      words >> id;
      ids[id] = graph.nodes.size();
      graph.nodes.push_back({read_pose(), 0, graph.nodes.empty()});
    } else if (tag == "EDGE_SE3:QUAT") {
      std::uint64_t from, to;
      words >> from >> to;
      PoseGraph::Edge edge;
      edge.from = ids.at(from);
      edge.to = ids.at(to);
      edge.T_from_to = read_pose();
      Matrix6d information;
      for (int i = 0; i < 6; ++i) {
        for (int j = i; j < 6; ++j) {
          words >> information(i, j);
          information(j, i) = information(i, j);
        }
      }
      const double tau = 3.0 / information.topLeftCorner<3, 3>().inverse().trace();
      const double kappa = 3.0 / (2.0 * information.bottomRightCorner<3, 3>().inverse().trace());
      edge.information.setZero();
      edge.information.topLeftCorner<3, 3>().diagonal().setConstant(tau);
      edge.information.bottomRightCorner<3, 3>().diagonal().setConstant(2.0 * kappa);
      graph.edges.push_back(edge);
    }
  }
  return graph;
}

}  // namespace unimapper::merge::testing
