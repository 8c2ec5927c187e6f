// Plausibility checks of sessions before a merge.
#include "session_check.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

namespace unimapper::merge {
namespace {

// Indices of sessions and keyframes travel in 16 bits in the map's files.
constexpr std::size_t kMaxSessions = 65534;
constexpr std::size_t kMaxKeyframes = 65534;
constexpr std::size_t kMaxNameBytes = 200;

bool is_file_name(const std::string& name) {
  const auto forbidden = [](char c) { return c == '/' || (c >= 0 && c < 32); };
  return !name.empty() && name != "." && name != ".." && name.size() <= kMaxNameBytes &&
         std::none_of(name.begin(), name.end(), forbidden);
}

/// Why a keyframe cannot be used; empty if it can.
std::string reason_against(const KeyframeRecord& keyframe, const KeyframeRecord* previous) {
  if (!keyframe.T_odometry_keyframe.is_rigid()) return "has no valid pose";
  if (previous != nullptr && keyframe.sequence <= previous->sequence) return "is out of order";
  if (keyframe.scans.empty() || keyframe.reference_scan >= keyframe.scans.size()) {
    return "has no reference scan";
  }
  const auto is_valid = [](const KeyframeScan& scan) { return scan.T_odometry_sensor.is_rigid(); };
  if (!std::all_of(keyframe.scans.begin(), keyframe.scans.end(), is_valid)) {
    return "has a scan without a valid pose";
  }
  return {};
}

void check_session(const SessionData& session) {
  if (!is_file_name(session.info.name)) {
    throw std::invalid_argument("a session's name cannot be a file name");
  }
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("session " + session.info.name + ": " + why);
  };
  if (session.keyframes.size() > kMaxKeyframes) refuse("more than 65534 keyframes");
  const KeyframeRecord* previous = nullptr;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    const std::string reason = reason_against(keyframe, previous);
    if (!reason.empty()) refuse("keyframe " + std::to_string(keyframe.sequence) + ' ' + reason);
    previous = &keyframe;
  }
}

}  // namespace

void check_sessions(const std::vector<SessionData>& sessions) {
  if (sessions.size() > kMaxSessions) throw std::invalid_argument("more than 65534 sessions");
  std::set<std::string> names;
  for (const auto& session : sessions) {
    check_session(session);
    if (!names.insert(session.info.name).second) {
      throw std::invalid_argument("two sessions are named " + session.info.name);
    }
  }
}

void check_statements(const UserStatements& statements, const std::vector<SessionData>& sessions) {
  const auto require_session = [&](std::uint32_t session) {
    if (session < sessions.size()) return;
    throw std::invalid_argument("a statement is about a session that is not there");
  };
  const auto require = [&](KeyframeId k) {
    require_session(k.session);
    if (k.keyframe < sessions[k.session].keyframes.size()) return;
    throw std::invalid_argument("a statement is about a keyframe that is not there");
  };
  for (const KeyframeLink& link : statements.links) {
    require(link.query);
    require(link.match);
    if (link.query == link.match) throw std::invalid_argument("a keyframe is linked to itself");
    if (link.T_match_query && !link.T_match_query->is_rigid()) {
      throw std::invalid_argument("the pose of a link is no rigid transform");
    }
    const bool apart =
        link.query.session != link.match.session &&
        (statements.keep_apart(link.query.session) || statements.keep_apart(link.match.session));
    if (apart || statements.forbid(link.query, link.match)) {
      throw std::invalid_argument("a link contradicts another statement");
    }
  }
  for (const KeyframePair& pair : statements.forbidden) {
    require(pair.a);
    require(pair.b);
  }
  for (const std::uint32_t session : statements.apart) require_session(session);
  std::set<KeyframeId> positioned;
  for (const KnownPosition& position : statements.positions) {
    require(position.keyframe);
    if (!positioned.insert(position.keyframe).second) {
      throw std::invalid_argument("a keyframe has two known positions");
    }
    // A map is no larger than a planet.
    constexpr double kFarthestM = 1e8;
    const auto is_deviation = [](double sigma) { return sigma >= 1e-4 && sigma <= kFarthestM; };
    const bool is_valid = std::abs(position.position.z()) <= kFarthestM &&
                          position.point.norm() <= kFarthestM && is_deviation(position.sigma_z_m) &&
                          !std::isnan(position.sigma_xy_m) &&
                          (!position.is_horizontal() ||
                           (is_deviation(position.sigma_xy_m) &&
                            position.position.head<2>().cwiseAbs().maxCoeff() <= kFarthestM));
    if (!is_valid) throw std::invalid_argument("a known position is no position");
  }
  if (!statements.reference) return;
  require_session(*statements.reference);
  if (statements.keep_apart(*statements.reference)) {
    throw std::invalid_argument("the reference session is kept apart");
  }
}

}  // namespace unimapper::merge
