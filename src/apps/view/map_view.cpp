#include "src/apps/view/map_view.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <unordered_set>
#include <utility>

#include "src/core/voxel_key.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

/// A position in a loop is weak along an axis whose deviation is larger.
constexpr double kWeakSigmaM = 0.5;

/// What a point was taken for (docs/api.md).
enum Category : std::uint8_t { kStatic = 0, kByRobot = 1, kByRefinement = 3 };

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

template <typename Vector>
Json numbers(const Vector& vector) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    json.push_back(rounded(static_cast<double>(vector[i])));
  }
  return json;
}

}  // namespace

Json describe_pose(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  Json json = numbers(pose.translation);
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) {
    json.push_back(std::round(value * 1e6) / 1e6);
  }
  return json;
}

double stamp_s(const KeyframeRecord& keyframe) {
  return 1e-9 * static_cast<double>(keyframe.scans[keyframe.reference_scan].stamp_ns);
}

namespace {

Json describe(const UprightBox& box) {
  return {{"centre", numbers(box.centre)},
          {"size", numbers(box.size)},
          {"heading", rounded(box.yaw_rad)}};
}

/// Where a provisional pair would place a session; null where none does.
Json provisional_pose(std::size_t session, const merge::MergeResult& result) {
  for (const merge::PairOutcome& pair : result.pairs) {
    if (pair.state != merge::PairState::kProvisional) continue;
    const std::size_t other = pair.query == session ? pair.match : pair.query;
    if (pair.query != session && pair.match != session) continue;
    if (!merge::is_in_map(result.sessions[other].status)) continue;
    const Pose& T_match_query = pair.T_match_session_query_session;
    const Pose T_other_session = pair.query == session ? T_match_query : T_match_query.inverse();
    // Its points are in its own frame, about an origin near them.
    return describe_pose(result.sessions[other].T_map_session * T_other_session *
                         result.sessions[session].T_map_session.inverse());
  }
  return nullptr;
}

Json describe_session(const SessionData& session, std::size_t index,
                      const merge::MergeResult& result) {
  const merge::MergedSession& merged = result.sessions[index];
  Json json;
  json["name"] = session.info.name;
  json["robot"] = session.info.id.robot;
  json["sensor"] = session.info.sensor;
  json["status"] = merge::status_name(merged.status);
  json["reason"] = merged.reason;
  json["provisional_pose"] = merged.status == merge::SessionStatus::kProvisional
                                 ? provisional_pose(index, result)
                                 : Json(nullptr);
  json["start_s"] = nullptr;
  if (!session.keyframes.empty()) json["start_s"] = stamp_s(session.keyframes.front());
  for (const char* list : {"sequences", "stamps_s", "poses"}) json[list] = Json::array();
  for (std::size_t k = 0; k < session.keyframes.size(); ++k) {
    const KeyframeRecord& keyframe = session.keyframes[k];
    json["sequences"].push_back(keyframe.sequence);
    json["stamps_s"].push_back(rounded(stamp_s(keyframe) - stamp_s(session.keyframes.front())));
    json["poses"].push_back(describe_pose(merged.T_map_keyframe[k]));
    if (keyframe.is_summary) json["summaries"].push_back(k);
  }
  if (!session.keyframes.empty() && merged.position_sigma_m.size() == session.keyframes.size()) {
    for (const double sigma_m : merged.position_sigma_m) {
      json["sigma_m"].push_back(rounded(sigma_m));
    }
  }
  return json;
}

std::size_t weak_axes(const merge::LoopConstraint& loop) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(loop.information.topLeftCorner<3, 3>(),
                                                            Eigen::EigenvaluesOnly);
  return static_cast<std::size_t>(
      (axes.eigenvalues().array() < 1.0 / (kWeakSigmaM * kWeakSigmaM)).count());
}

/// Whether a loop waits itself, or its two sessions are a pair that waits.
bool is_provisional(const merge::LoopConstraint& loop, const merge::MergeResult& result) {
  if (loop.decision.reason.starts_with("waits")) return true;
  const std::uint32_t low = std::min(loop.query.session, loop.match.session);
  const std::uint32_t high = std::max(loop.query.session, loop.match.session);
  return std::any_of(result.pairs.begin(), result.pairs.end(), [&](const auto& pair) {
    return pair.state == merge::PairState::kProvisional && pair.match == low &&
           pair.query == high && loop.decision.reason == pair.reason;
  });
}

void describe_residual(const merge::LoopConstraint& loop, const merge::MergeResult& result,
                       Json& json) {
  const merge::MergedSession& query = result.sessions[loop.query.session];
  const merge::MergedSession& match = result.sessions[loop.match.session];
  const bool share_a_frame =
      loop.is_intra_session() || (merge::is_in_map(query.status) && merge::is_in_map(match.status));
  json["residual_m"] = nullptr;
  json["residual_deg"] = nullptr;
  if (!share_a_frame) return;
  const Pose off = loop.T_match_query.inverse() *
                   match.T_map_keyframe[loop.match.keyframe].inverse() *
                   query.T_map_keyframe[loop.query.keyframe];
  json["residual_m"] = rounded(off.translation.norm());
  json["residual_deg"] = rounded(Eigen::AngleAxisd(off.rotation).angle() * 180.0 / M_PI);
}

Json describe_loop(const merge::LoopConstraint& loop, const merge::MergeResult& result) {
  Json json;
  json["query"] = {loop.query.session, loop.query.keyframe};
  json["match"] = {loop.match.session, loop.match.keyframe};
  json["state"] = loop.decision.accepted         ? "accepted"
                  : is_provisional(loop, result) ? "provisional"
                                                 : "refused";
  json["reason"] = loop.decision.reason;
  json["overlap"] = rounded(loop.overlap);
  json["confidence"] = rounded(static_cast<double>(loop.confidence));
  json["T_match_query"] = describe_pose(loop.T_match_query);
  describe_residual(loop, result, json);
  json["weak_axes"] = loop.decision.accepted ? weak_axes(loop) : 0;
  json["by_person"] = loop.by_person;
  json["statement"] = loop.by_person ? Json("right") : Json(nullptr);
  return json;
}

Json describe_pair(const merge::PairOutcome& pair) {
  return {{"match", pair.match},   {"query", pair.query}, {"state", state_name(pair.state)},
          {"reason", pair.reason}, {"loops", pair.loops}, {"consistent", pair.distinct}};
}

Json describe_change(const merge::ChangedObject& object) {
  Json json;
  json["kind"] = kind_name(object.kind);
  json["session"] = object.session;
  json["free_in"] = object.free_in;
  json["box"] = describe(object.box);
  json["before"] = object.before ? describe(*object.before) : Json(nullptr);
  json["confidence"] = rounded(object.confidence);
  return json;
}

/// Visits the cells of a keyframe with what the robot, and then the base, took them for.
template <typename Visit>
void visit_categories(const KeyframeRecord& keyframe, const merge::RefinedKeyframe* refined,
                      const Visit& visit) {
  const merge::RefinedKeyframe as_it_is;
  const merge::RefinedKeyframe& labels = refined != nullptr ? *refined : as_it_is;
  merge::visit_cells(keyframe, labels, false, [&](const FineCell& cell) { visit(cell, kStatic); });
  const auto* first = keyframe.static_cells.data();
  const auto* last = first + keyframe.static_cells.size();
  merge::visit_cells(keyframe, labels, true, [&](const FineCell& cell) {
    const bool was_static = first <= &cell && &cell < last;
    visit(cell, was_static ? kByRefinement : kByRobot);
  });
}

/// Of what was removed, one point per voxel as long as so many voxels are remembered: beyond it
/// some come twice, and memory stays bounded.
constexpr std::size_t kMostRemembered = std::size_t{1} << 22U;

ViewPoints removed_points(const std::vector<SessionData>& sessions,
                          const merge::MergeResult& result, float voxel_m) {
  ViewPoints points(result.map.file());
  std::unordered_set<VoxelKey> taken;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const merge::MergedSession& merged = result.sessions[s];
    if (!merge::is_in_map(merged.status)) continue;
    taken.clear();
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      if (taken.size() > kMostRemembered) taken.clear();
      const auto keyframe = whole_keyframe(sessions[s], k);
      const Eigen::Matrix3f rotation = merged.T_map_keyframe[k].rotation.cast<float>();
      const Eigen::Vector3f translation = merged.T_map_keyframe[k].translation.cast<float>();
      const auto* refined = merged.refined.empty() ? nullptr : &merged.refined[k];
      visit_categories(*keyframe, refined, [&](const FineCell& cell, Category category) {
        if (category == kStatic) return;
        const Eigen::Vector3f position = rotation * cell.position + translation;
        if (!taken.insert(pack(voxel_index(position, 1.0F / voxel_m))).second) return;
        points.push_back({position, session_byte(s), category});
      });
    }
  }
  return points;
}

ViewPoints static_points(const merge::MergeResult& result) {
  ViewPoints points(result.map.file());
  for (const merge::MapPoint& point : result.map) {
    points.push_back({point.position, session_byte(point.session),
                      static_cast<std::uint8_t>(std::min(point.sessions_seen, 255U)),
                      static_cast<std::uint8_t>(point.intensity)});
  }
  return points;
}

ViewPoints changed_points(const merge::MergeResult& result) {
  ViewPoints points(result.map.file());
  for (const merge::ChangedPoint& point : result.changes) {
    const bool is_known = point.object < result.changed_objects.size();
    const bool moved = is_known && result.changed_objects[point.object].kind == ChangeKind::kMoved;
    const ChangeKind kind = moved            ? ChangeKind::kMoved
                            : point.appeared ? ChangeKind::kAppeared
                                             : ChangeKind::kGone;
    points.push_back(
        {point.position, session_byte(point.session), static_cast<std::uint8_t>(kind)});
  }
  return points;
}

}  // namespace

Json describe_merge(const std::vector<SessionData>& sessions, const merge::MergeResult& result) {
  Json json;
  for (const char* list : {"sessions", "loops", "pairs", "changes"}) json[list] = Json::array();
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    json["sessions"].push_back(describe_session(sessions[s], s, result));
  }
  for (const auto& loop : result.loops) json["loops"].push_back(describe_loop(loop, result));
  for (const auto& pair : result.pairs) json["pairs"].push_back(describe_pair(pair));
  for (const auto& object : result.changed_objects) {
    json["changes"].push_back(describe_change(object));
  }
  json["georeference"] = nullptr;
  if (result.georeference) {
    json["georeference"] = {{"origin", numbers(result.georeference->origin)},
                            {"horizontal", result.georeference->is_horizontal}};
  }
  return json;
}

Layers layers_of(const std::vector<SessionData>& sessions, const merge::MergeResult& result,
                 float voxel_m) {
  Layers layers;
  layers["static"] = make_octree(static_points(result));
  layers["removed"] = make_octree(removed_points(sessions, result, voxel_m));
  layers["changes"] = make_octree(changed_points(result));
  return layers;
}

Json describe_layers(const Layers& layers) {
  Json json = Json::object();
  for (const auto& [name, octree] : layers) {
    if (octree.nodes.empty()) continue;
    Json nodes = Json::array();
    const std::map<std::string, std::uint64_t> bytes = octree.blocks.sizes();
    for (const OctreeNode& node : octree.nodes) {
      Json bounds = numbers(node.bounds.min());
      for (const auto& value : numbers(node.bounds.max())) bounds.push_back(value);
      nodes.push_back({node.key, node.points, bytes.at(node.key), std::move(bounds)});
    }
    json[name] = {{"origin", numbers(octree.origin)}, {"size_m", octree.size_m}, {"nodes", nodes}};
    if (octree.has_intensity) json[name]["intensity"] = true;
  }
  return json;
}

std::string keyframe_block(const KeyframeRecord& keyframe, const merge::RefinedKeyframe* refined,
                           std::uint8_t session, std::size_t most) {
  std::vector<ViewPoint> points;
  Eigen::AlignedBox3f bounds;
  const std::size_t cells = keyframe.static_cells.size() + keyframe.dynamic_cells.size();
  const std::size_t step = cells / std::max<std::size_t>(1, most) + 1;
  std::size_t number = 0;
  visit_categories(keyframe, refined, [&](const FineCell& cell, Category category) {
    if (number++ % step != 0) return;
    points.push_back({cell.position, session, category});
    bounds.extend(cell.position);
  });
  if (points.empty()) return gzipped(point_block(points, Eigen::Vector3f::Zero(), 1.0F));
  const float extent = std::max(0.001F, bounds.sizes().maxCoeff());
  return gzipped(point_block(points, bounds.min(), extent / 65535.0F));
}

}  // namespace unimapper::apps
