// Evaluation in Python: errors of trajectories, labels and maps.
#include <stdexcept>

#include "ports/python/arrays.hpp"
#include "ports/python/bindings.hpp"
#include "src/evaluate/dynamic.hpp"
#include "src/evaluate/map_quality.hpp"
#include "unimapper/evaluate/trajectory.hpp"

namespace unimapper::python {
namespace {

using evaluate::StampedPose;

std::vector<StampedPose> stamped_poses(const py::object& stamps_ns, const py::object& poses,
                                       const std::string& name) {
  const auto stamps = vector_of<std::int64_t>(stamps_ns, (name + "_stamps_ns").c_str());
  const std::vector<Pose> values = poses_of(poses, (name + "_poses").c_str());
  if (static_cast<std::size_t>(stamps.size()) != values.size()) {
    throw py::value_error(name + ": " + std::to_string(stamps.size()) + " stamps of " +
                          std::to_string(values.size()) + " poses");
  }
  std::vector<StampedPose> stamped;
  for (std::size_t i = 0; i < values.size(); ++i) {
    stamped.push_back({stamps.data()[i], values[i]});
    if (i > 0 && stamped[i].stamp_ns < stamped[i - 1].stamp_ns) {
      throw py::value_error(name + "_stamps_ns: not in order of time");
    }
  }
  return stamped;
}

py::dict error_dict(const evaluate::ErrorStatistics& statistics) {
  py::dict result;
  result["rmse"] = statistics.rmse;
  result["mean"] = statistics.mean;
  result["median"] = statistics.median;
  result["std"] = statistics.std;
  result["min"] = statistics.min;
  result["max"] = statistics.max;
  result["count"] = statistics.count;
  return result;
}

py::dict trajectory_error_of(const py::object& stamps_ns, const py::object& poses,
                             const py::object& truth_stamps_ns, const py::object& truth_poses,
                             const py::object& T_truth_estimate) {
  const auto pairs = evaluate::associate(stamped_poses(stamps_ns, poses, "estimate"),
                                         stamped_poses(truth_stamps_ns, truth_poses, "truth"));
  if (pairs.empty()) throw py::value_error("no two stamps within 10 ms");
  const Pose alignment = T_truth_estimate.is_none()
                             ? evaluate::align(pairs).T_truth_estimate
                             : rigid_pose_of(T_truth_estimate, "T_truth_estimate");
  const evaluate::TrajectoryError error = evaluate::trajectory_error(pairs, alignment);
  py::dict result;
  result["translation_m"] = error_dict(error.translation_m);
  result["rotation_deg"] = error_dict(error.rotation_deg);
  result["tilt_deg"] = error_dict(error.tilt_deg);
  result["T_truth_estimate"] = array_of(alignment);
  return result;
}

/// Labels of a run by scans.
struct LabelScore {
  evaluate::DynamicScore score;

  void add(const py::object& points, const py::object& labels, const py::object& truth) {
    const std::vector<Eigen::Vector3f> positions = positions_of(points, "points");
    const auto predicted = vector_of<std::uint8_t>(labels, "labels");
    const auto true_labels = vector_of<std::uint32_t>(truth, "truth");
    const auto count = static_cast<py::ssize_t>(positions.size());
    if (predicted.size() != count || true_labels.size() != count) {
      throw py::value_error("labels and truth: one for each of " + std::to_string(count) +
                            " points");
    }
    constexpr std::uint32_t kStaticLabel = 9;
    constexpr std::uint32_t kDynamicLabel = 251;
    std::vector<std::uint32_t> numbered;
    for (const std::uint8_t label : span_of(predicted)) {
      const bool dynamic = label == static_cast<std::uint8_t>(PointLabel::kDynamic);
      numbered.push_back(dynamic ? kDynamicLabel : kStaticLabel);
    }
    evaluate::score_scan({positions, Pose(), span_of(true_labels), numbered}, score);
  }
};

void bind_label_score(py::module_& module) {
  py::class_<LabelScore>(module, "LabelScore",
                         "Accuracy of labels against the truth, point by point.")
      .def(py::init<>())
      .def("add_scan", &LabelScore::add, py::arg("points"), py::arg("labels"), py::arg("truth"),
           "Counts a scan. points: (N, 3) or (N, 4) float32, metres; labels: (N,) uint8, of the "
           "pipeline;\ntruth: (N,) uint32, as SemanticKITTI numbers them: 251 to 259 are dynamic, "
           "0 and 1 ignored.")
      .def_property_readonly(
          "static_accuracy", [](const LabelScore& s) { return s.score.total.static_accuracy(); },
          "SA in [0, 1]; NaN without static points.")
      .def_property_readonly(
          "dynamic_accuracy", [](const LabelScore& s) { return s.score.total.dynamic_accuracy(); },
          "DA in [0, 1]; NaN without dynamic points.")
      .def_property_readonly(
          "associated_accuracy",
          [](const LabelScore& s) { return s.score.total.associated_accuracy(); },
          "AA, the root of SA times DA.");
}

/// Positions that are finite: trees of the others are none.
std::vector<Eigen::Vector3f> finite_positions(const py::object& object, const char* name) {
  std::vector<Eigen::Vector3f> positions = positions_of(object, name);
  for (const Eigen::Vector3f& p : positions) {
    if (!p.allFinite()) throw py::value_error(std::string(name) + ": NaN or infinite");
  }
  return positions;
}

py::dict agreement_dict(const py::object& first, const py::object& second, double tau_m) {
  if (!(tau_m > 0.0)) throw py::value_error("tau_m: a positive distance");
  const std::vector<Eigen::Vector3f> a = finite_positions(first, "first");
  const std::vector<Eigen::Vector3f> b = finite_positions(second, "second");
  evaluate::CloudAgreement agreement;
  {
    const py::gil_scoped_release release;
    agreement = evaluate::compare_clouds(a, b, tau_m);
  }
  py::dict result;
  result["ac_rmse_m"] = agreement.ac_rmse_m;
  result["ac_mean_m"] = agreement.ac_mean_m;
  result["cd_l2_m"] = agreement.cd_l2_m;
  result["inliers_first"] = agreement.inliers_first;
  result["inliers_second"] = agreement.inliers_second;
  return result;
}

}  // namespace

void bind_evaluate(py::module_& module) {
  bind_label_score(module);
  module.def("trajectory_error", &trajectory_error_of, py::arg("stamps_ns"), py::arg("poses"),
             py::arg("truth_stamps_ns"), py::arg("truth_poses"),
             py::arg("T_truth_estimate") = py::none(),
             "Absolute trajectory error. Poses within 10 ms are of the same instant.\n\n"
             "stamps: (N,) int64, nanoseconds, in order; poses: (N, 4, 4), metres.\n"
             "T_truth_estimate: alignment of the frames; None: the least-squares one.\n"
             "Returns a dict: translation_m, rotation_deg and tilt_deg with rmse, mean, median, "
             "std, min, max\nand count each, and the alignment.");
  module.def("compare_clouds", &agreement_dict, py::arg("first"), py::arg("second"),
             py::arg("tau_m"),
             "Agreement (AC, CD) of two clouds of shape (N, 3), float32, metres, from neighbours "
             "within tau_m.");
}

}  // namespace unimapper::python
