// Contents of a stored project, for `unimapper map list`, `show` and `check`.
#include <cstdio>
#include <ctime>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "src/apps/map/map_options.hpp"
#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/print.hpp"

namespace unimapper::apps {
namespace {

using MapJson = nlohmann::ordered_json;
using store::StatementKind;

/// Unix time as ISO 8601, UTC.
std::string utc_text(std::int64_t seconds) {
  const std::time_t time = static_cast<std::time_t>(seconds);
  std::tm parts{};
  char text[32] = "";
  if (gmtime_r(&time, &parts) != nullptr) std::strftime(text, sizeof text, "%FT%TZ", &parts);
  return text;
}

MapJson describe(const store::Epoch& epoch) {
  MapJson json = {{"epoch", epoch.number},          {"parent", epoch.parent},
                  {"made", utc_text(epoch.made_s)}, {"command", epoch.command},
                  {"outcome", epoch.outcome},       {"has_map", epoch.result != 0}};
  if (epoch.purged_by != 0) json["purged_by"] = epoch.purged_by;
  return json;
}

MapJson describe(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

MapJson describe(const store::StoredPosition& position) {
  MapJson json = {{"keyframe", position.sequence}};
  if (position.sigma_xy_m) {
    json["position"] = describe(position.position);
    json["sigma_xy"] = *position.sigma_xy_m;
  } else {
    json["height"] = position.position.z();
  }
  json["sigma_z"] = position.sigma_z_m;
  json["point"] = describe(position.point);
  return json;
}

MapJson describe(const store::StoredStatement& statement, const SessionNames& names) {
  MapJson json = {{"statement", statement.id}, {"kind", store::kind_name(statement.kind)}};
  const bool is_of_two =
      statement.kind == StatementKind::kLink || statement.kind == StatementKind::kForbidden;
  if (is_of_two) {
    json["query"] = names.text(statement.query);
    json["match"] = names.text(statement.match);
    json["has_pose"] = statement.T_match_query.has_value();
  } else {
    json["session"] = names.name(statement.match.session);
  }
  for (const store::StoredPosition& position : statement.positions) {
    json["positions"].push_back(describe(position));
  }
  return json;
}

MapJson describe(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& t = pose.translation;
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

/// Sessions of the project with their state in its map.
MapJson describe_sessions(const store::ProjectState& state, const store::MapResult& result,
                          const std::vector<store::SessionListing>& listings) {
  std::map<std::int64_t, const store::SessionResult*> merged;
  for (const auto& session : result.sessions) merged[session.session] = &session;
  const std::set<std::int64_t> in_project(state.sessions.begin(), state.sessions.end());
  MapJson all = MapJson::array();
  for (const store::SessionListing& listing : listings) {
    if (in_project.count(listing.row) == 0) continue;
    MapJson session = {{"name", listing.info.name},
                       {"sensor", listing.info.sensor},
                       {"keyframes", listing.keyframes}};
    const auto found = merged.find(listing.row);
    session["state"] = found == merged.end() ? "not merged yet" : found->second->state;
    if (found != merged.end()) {
      session["merged_keyframes"] = found->second->sequences.size();
      if (!found->second->reason.empty()) session["reason"] = found->second->reason;
      session["T_map_session"] = describe(found->second->T_map_session);
    }
    all.push_back(session);
  }
  return all;
}

/// What the merge made of known positions.
MapJson describe_positions(const store::MapResult& result, const SessionNames& names) {
  MapJson json = {{"known", result.positions.size()}, {"used", 0}, {"rejected", MapJson::array()}};
  std::size_t used = 0;
  for (const store::PositionResult& position : result.positions) {
    used += position.used ? 1 : 0;
    if (position.used) continue;
    json["rejected"].push_back(
        {{"keyframe", names.text(position.keyframe)}, {"reason", position.reason}});
  }
  json["used"] = used;
  if (result.georeference) json["origin"] = describe(result.georeference->origin);
  return json;
}

MapJson describe_loops(const store::MapResult& result) {
  std::map<std::string, std::size_t> reasons;
  std::size_t accepted = 0;
  for (const store::LoopResult& loop : result.loops) {
    accepted += loop.accepted ? 1 : 0;
    // Figures differ from loop to loop: "overlap 0.31 (limit 0.45)".
    ++reasons[loop.reason.substr(0, loop.reason.find_first_of("0123456789"))];
  }
  return {{"considered", result.loops.size()}, {"accepted", accepted}, {"by_reason", reasons}};
}

std::string word(const MapJson& json) { return json.get<std::string>(); }

void print_epoch(const MapJson& epoch) {
  const std::string gone = epoch.contains("purged_by")
                               ? " (gone: epoch " +
                                     std::to_string(epoch["purged_by"].get<std::int64_t>()) +
                                     " removed a session of it for good)"
                               : "";
  print_to(stdout, "epoch {}  {}  {}: {}{}\n", epoch["epoch"].get<std::int64_t>(),
           word(epoch["made"]), word(epoch["command"]), word(epoch["outcome"]), gone);
}

void print_positions(const MapJson& positions) {
  print_to(stdout, "positions  {} known, {} used\n", positions["known"].get<std::uint64_t>(),
           positions["used"].get<std::uint64_t>());
  for (const MapJson& rejected : positions["rejected"]) {
    print_to(stdout, "           {}: {}\n", word(rejected["keyframe"]), word(rejected["reason"]));
  }
}

void print_project(const MapJson& json) {
  if (json["epoch"].is_null()) {
    print_to(stdout, "no epoch yet\n");
  } else {
    print_epoch(json["epoch"]);
  }
  for (const MapJson& session : json["sessions"]) {
    print_to(stdout, "session    {}: {}, {} keyframes, {}{}\n", word(session["name"]),
             word(session["sensor"]), session["keyframes"].get<std::uint64_t>(),
             word(session["state"]),
             session.contains("reason") ? (": " + word(session["reason"])).c_str() : "");
  }
  if (json.contains("crs")) print_to(stdout, "system     {}\n", word(json["crs"]));
  for (const MapJson& statement : json["statements"]) {
    const std::string about = statement.contains("session")
                                  ? word(statement["session"])
                                  : word(statement["query"]) + " " + word(statement["match"]);
    const std::string count =
        statement.contains("positions")
            ? " of " + std::to_string(statement["positions"].size()) + " keyframes"
            : "";
    print_to(stdout, "statement  {}: {} {}{}\n", statement["statement"].get<std::int64_t>(),
             word(statement["kind"]), about, count);
  }
  if (json.contains("positions")) print_positions(json["positions"]);
  const MapJson& loops = json["loops"];
  print_to(stdout, "loops      {} considered, {} accepted\n",
           loops["considered"].get<std::uint64_t>(), loops["accepted"].get<std::uint64_t>());
  for (const auto& [reason, count] : loops["by_reason"].items()) {
    print_to(stdout, "           {}: {}\n", count.get<std::uint64_t>(), reason);
  }
}

}  // namespace

void list_epochs(const ProjectOptions& options) {
  store::StoreReader reader(options.store);
  MapJson all = MapJson::array();
  for (const store::Epoch& epoch : reader.project().epochs()) all.push_back(describe(epoch));
  if (options.json) {
    std::cout << MapJson{{"epochs", all}}.dump(2) << '\n';
    return;
  }
  for (const MapJson& epoch : all) print_epoch(epoch);
  if (all.empty()) print_to(stdout, "no epoch yet\n");
}

void show_epoch(const ProjectOptions& options) {
  store::StoreReader reader(options.store);
  const std::vector<store::SessionListing> listings = reader.sessions();
  store::ProjectReader project = reader.project();
  const store::ProjectState state = options.epoch > 0 ? project.at(options.epoch) : project.next();
  const store::MapResult result =
      state.epoch.result == 0 ? store::MapResult{} : project.result(state.epoch.result);
  const SessionNames names(listings);
  MapJson json;
  json["epoch"] = state.epoch.number == 0 ? MapJson() : describe(state.epoch);
  json["sessions"] = describe_sessions(state, result, listings);
  if (!state.crs.empty()) json["crs"] = state.crs;
  json["statements"] = MapJson::array();
  for (const auto& statement : state.statements) {
    json["statements"].push_back(describe(statement, names));
  }
  if (!result.positions.empty()) json["positions"] = describe_positions(result, names);
  json["loops"] = describe_loops(result);
  if (options.json) {
    std::cout << json.dump(2) << '\n';
  } else {
    print_project(json);
  }
}

void check_project(const ProjectOptions& options) {
  store::StoreReader reader(options.store);
  const std::vector<std::string> faults = reader.check();
  if (options.json) {
    std::cout << MapJson{{"faults", faults}}.dump(2) << '\n';
  } else {
    for (const std::string& fault : faults) std::cout << "fault      " << fault << '\n';
    if (faults.empty()) std::cout << "every page, keyframe and epoch is sound\n";
  }
  if (!faults.empty()) {
    throw std::runtime_error(options.store.string() + ": " + std::to_string(faults.size()) +
                             " faults");
  }
}

}  // namespace unimapper::apps
