#include "src/apps/map/known_positions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "src/core/pose_interpolation.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {
namespace {

// Scans farther apart than this have a gap between them.
constexpr std::int64_t kLongestStepNs = 2500000000;

std::string seconds_text(std::int64_t stamp_ns) {
  return fmt::format("{:.3f}", 1e-9 * static_cast<double>(stamp_ns));
}

/// Sensor poses of a session by stamp, and reference scans of its keyframes.
class SessionTimes {
 public:
  explicit SessionTimes(const SessionData& session) {
    for (const auto* keyframes : {&session.keyframes, &session.summaries}) {
      for (const KeyframeRecord& keyframe : *keyframes) {
        for (const KeyframeScan& scan : keyframe.scans) {
          poses_.emplace(scan.stamp_ns, scan.T_odometry_sensor);
        }
        if (keyframe.reference_scan >= keyframe.scans.size()) continue;
        references_[keyframe.scans[keyframe.reference_scan].stamp_ns] = keyframe.sequence;
        sequences_[keyframe.sequence] = keyframe.scans[keyframe.reference_scan];
      }
    }
  }

  [[nodiscard]] bool has(std::uint32_t sequence) const { return sequences_.count(sequence) > 0; }
  [[nodiscard]] bool contains(std::int64_t stamp_ns) const {
    return !poses_.empty() && poses_.begin()->first <= stamp_ns &&
           stamp_ns <= poses_.rbegin()->first;
  }
  [[nodiscard]] std::string span_text() const {
    return poses_.empty() ? "never"
                          : "from " + seconds_text(poses_.begin()->first) + " to " +
                                seconds_text(poses_.rbegin()->first);
  }

  /// Nothing in a gap. The stamp lies within the session.
  [[nodiscard]] std::optional<Pose> T_odometry_sensor(std::int64_t stamp_ns) const {
    const auto after = poses_.lower_bound(stamp_ns);
    if (after->first == stamp_ns) return after->second;
    const auto before = std::prev(after);
    const std::int64_t span = after->first - before->first;
    if (span > kLongestStepNs) return std::nullopt;
    return interpolate(before->second, after->second,
                       static_cast<double>(stamp_ns - before->first) / static_cast<double>(span));
  }

  /// The keyframe whose reference scan is nearest.
  [[nodiscard]] std::uint32_t nearest(std::int64_t stamp_ns) const {
    const auto after = references_.lower_bound(stamp_ns);
    if (after == references_.begin()) return after->second;
    const auto before = std::prev(after);
    if (after == references_.end()) return before->second;
    return stamp_ns - before->first <= after->first - stamp_ns ? before->second : after->second;
  }
  [[nodiscard]] const KeyframeScan& reference(std::uint32_t sequence) const {
    return sequences_.at(sequence);
  }

 private:
  std::map<std::int64_t, Pose> poses_;
  std::map<std::int64_t, std::uint32_t> references_;
  std::map<std::uint32_t, KeyframeScan> sequences_;
};

}  // namespace

AssignedPositions assign_positions(const SessionData& session, const std::vector<PositionRow>& rows,
                                   const Eigen::Vector3d& lever, const std::string& file) {
  const SessionTimes times(session);
  struct Chosen {
    store::StoredPosition position;
    std::int64_t away_ns = 0;
  };
  std::map<std::uint32_t, Chosen> chosen;
  for (const PositionRow& row : rows) {
    const auto fail = [&](const std::string& why) {
      throw std::runtime_error(file + ":" + std::to_string(row.line) + ": " + why);
    };
    Chosen found;
    const Eigen::Vector3d point = row.lever.value_or(lever);
    found.position.point = point;
    if (row.sequence) {
      if (!times.has(*row.sequence)) {
        fail("there is no keyframe " + session.info.name + ":" + std::to_string(*row.sequence));
      }
      found.position.sequence = *row.sequence;
    } else {
      if (!times.contains(row.stamp_ns)) continue;
      const std::optional<Pose> T_odometry_sensor = times.T_odometry_sensor(row.stamp_ns);
      if (!T_odometry_sensor) continue;
      found.position.sequence = times.nearest(row.stamp_ns);
      const KeyframeScan& reference = times.reference(found.position.sequence);
      found.away_ns = std::abs(row.stamp_ns - reference.stamp_ns);
      if (found.away_ns > kLongestStepNs) continue;
      found.position.point = reference.T_odometry_sensor.inverse() * (*T_odometry_sensor * point);
    }
    found.position.position = row.position;
    found.position.sigma_xy_m = row.sigma_xy_m;
    found.position.sigma_z_m = row.sigma_z_m;
    const auto [before, is_new] = chosen.emplace(found.position.sequence, found);
    if (!is_new && found.away_ns < before->second.away_ns) before->second = found;
  }
  AssignedPositions assigned;
  assigned.lasts = times.span_text();
  for (const auto& [sequence, one] : chosen) assigned.positions.push_back(one.position);
  assigned.left_out = rows.size() - assigned.positions.size();
  return assigned;
}

merge::KnownPosition known_position(KeyframeId id, const KeyframeRecord& keyframe,
                                    const store::StoredPosition& position) {
  return {id, position.position, merge::reference_sensor_pose(keyframe) * position.point,
          position.sigma_xy_m.value_or(std::numeric_limits<double>::infinity()),
          position.sigma_z_m};
}

std::vector<merge::KnownPosition> positions_of(const store::ProjectState& state,
                                               const KeyframeRows& rows) {
  std::map<KeyframeId, std::pair<bool, std::int64_t>> said_by;  // alone, statement
  const auto for_each = [&](const auto& take) {
    for (const store::StoredStatement& statement : state.statements) {
      for (const store::StoredPosition& position : statement.positions) {
        const auto keyframe = rows.find({statement.match.session, position.sequence});
        if (keyframe) take(statement, position, *keyframe);
      }
    }
  };
  const auto rank = [](const store::StoredStatement& statement) {
    return std::make_pair(statement.positions.size() == 1, statement.id);
  };
  for_each([&](const auto& statement, const auto&, KeyframeId keyframe) {
    said_by[keyframe] = std::max(said_by[keyframe], rank(statement));
  });
  std::vector<merge::KnownPosition> positions;
  for_each([&](const auto& statement, const auto& position, KeyframeId keyframe) {
    if (said_by[keyframe] != rank(statement)) return;
    const KeyframeRecord& record = rows.sessions()[keyframe.session].keyframes[keyframe.keyframe];
    positions.push_back(known_position(keyframe, record, position));
  });
  return positions;
}

void keep_positions(const merge::MergeResult& result, const KeyframeRows& rows,
                    store::MapResult& stored) {
  for (const merge::PositionOutcome& outcome : result.positions) {
    store::PositionResult& position = stored.positions.emplace_back();
    position.keyframe = rows.row(outcome.given.keyframe);
    position.position = outcome.given.position;
    position.point = outcome.given.point;
    if (outcome.given.is_horizontal()) position.sigma_xy_m = outcome.given.sigma_xy_m;
    position.sigma_z_m = outcome.given.sigma_z_m;
    position.used = outcome.used;
    position.reason = outcome.reason;
    position.residual = outcome.residual_m;
  }
  if (!result.georeference) return;
  store::GeoreferenceResult& georeference = stored.georeference.emplace();
  georeference.origin = result.georeference->origin;
  georeference.is_horizontal = result.georeference->is_horizontal;
  if (std::isfinite(result.georeference->heading_sigma_rad)) {
    georeference.heading_sigma_rad = result.georeference->heading_sigma_rad;
  }
}

void restore_positions(const store::MapResult& stored, const KeyframeRows& rows,
                       merge::MergeResult& posed) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  for (const store::PositionResult& position : stored.positions) {
    const auto keyframe = rows.find(position.keyframe);
    if (!keyframe) throw std::runtime_error("a keyframe of the map is damaged in the store");
    merge::PositionOutcome& outcome = posed.positions.emplace_back();
    outcome.given = {*keyframe, position.position, position.point,
                     position.sigma_xy_m.value_or(kUnknown), position.sigma_z_m};
    outcome.used = position.used;
    outcome.reason = position.reason;
    outcome.residual_m = position.residual;
  }
  if (!stored.georeference) return;
  posed.georeference =
      merge::Georeference{stored.georeference->origin, stored.georeference->is_horizontal,
                          stored.georeference->heading_sigma_rad.value_or(kUnknown)};
}

}  // namespace unimapper::apps
