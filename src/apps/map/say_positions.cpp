// Known positions as statements of people.
#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/store/project_writer.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/map/known_positions.hpp"
#include "src/apps/map/map_options.hpp"
#include "src/apps/map/position_file.hpp"
#include "src/apps/map/site_system.hpp"
#include "src/apps/map/statements.hpp"
#include "src/apps/map/stored_sessions.hpp"

namespace unimapper::apps {
namespace {

SessionData read_session(const ProjectOptions& options, std::int64_t row) {
  store::StoreReader reader(options.store);
  for (const store::SessionListing& listing : reader.sessions()) {
    if (listing.row == row) return reader.read(listing);
  }
  throw std::runtime_error("the session is not in the store any more");
}

Eigen::Vector3d lever_of(const PositionOption& given) {
  if (given.lever.empty()) return Eigen::Vector3d::Zero();
  Eigen::Vector3d lever(given.lever[0], given.lever[1], given.lever[2]);
  if (!(lever.norm() <= 100.0)) throw std::runtime_error("--lever: no more than 100 m");
  return lever;
}

/// The row that a file would have.
PositionRow row_of(const PositionOption& given, std::uint32_t sequence) {
  PositionRow row;
  row.sequence = sequence;
  const bool is_height = given.at.empty();
  if (is_height && given.sigma.size() != 1) {
    throw std::runtime_error("--sigma: a height has one standard deviation");
  }
  row.position = is_height ? Eigen::Vector3d(0.0, 0.0, given.height_m)
                           : Eigen::Vector3d(given.at[0], given.at[1], given.at[2]);
  if (!(row.position.cwiseAbs().maxCoeff() <= 1e8) || !row.position.allFinite()) {
    throw std::runtime_error("the position is out of range");
  }
  for (const double sigma : given.sigma) {
    if (!(sigma >= 1e-4 && sigma <= 1e6)) throw std::runtime_error("--sigma: from 0.0001 m on");
  }
  if (!is_height) row.sigma_xy_m = given.sigma.front();
  row.sigma_z_m = given.sigma.back();
  return row;
}

store::StoredStatement statement_of(std::int64_t session,
                                    std::vector<store::StoredPosition> positions) {
  store::StoredStatement statement;
  statement.kind = store::StatementKind::kPosition;
  statement.match.session = session;
  statement.positions = std::move(positions);
  return statement;
}

std::optional<Datum> datum_of(const PositionOption& given) {
  if (given.datum.empty()) return std::nullopt;
  const Datum datum{given.datum[0], given.datum[1], given.datum[2]};
  const bool is_place = std::abs(datum.latitude_deg) <= 90.0 &&
                        std::abs(datum.longitude_deg) <= 180.0 && std::abs(datum.height_m) <= 1e5;
  if (!is_place) throw std::runtime_error("--datum: no place on the earth");
  return datum;
}

std::string datum_text(const PositionOption& given) {
  std::string text;
  for (const double number : given.datum) text += " " + std::to_string(number);
  return text.empty() ? text : " --datum" + text;
}

/// The project's coordinate system.
std::optional<Projection> system_of(const ProjectOptions& options) {
  store::StoreReader reader(options.store);
  const std::string name = reader.project().next().crs;
  return name.empty() ? std::nullopt : std::make_optional<Projection>(name);
}

}  // namespace

void set_system(const ProjectOptions& options, const std::string& name) {
  say_epoch(state_system(options.store, name));
}

void give_position(const ProjectOptions& options, const PositionOption& given) {
  const store::KeyframeRow keyframe =
      SessionNames(store::StoreReader(options.store).sessions()).keyframe(given.keyframe);
  const SessionData session = read_session(options, keyframe.session);
  const PositionRow row = row_of(given, keyframe.sequence);
  const auto is_it = [&](const KeyframeRecord& k) { return k.sequence == keyframe.sequence; };
  if (std::none_of(session.keyframes.begin(), session.keyframes.end(), is_it) &&
      std::none_of(session.summaries.begin(), session.summaries.end(), is_it)) {
    throw std::runtime_error("there is no keyframe " + given.keyframe);
  }
  const AssignedPositions assigned = assign_positions(session, {row}, lever_of(given), "--at");
  const std::optional<Projection> system = system_of(options);
  if (system) warn_of_place(*system, assigned.positions);
  state_it(options, "`unimapper map position`", "position " + given.keyframe,
           "position of " + given.keyframe, {statement_of(keyframe.session, assigned.positions)});
}

void give_positions(const ProjectOptions& options, const PositionOption& given) {
  const std::int64_t row =
      SessionNames(store::StoreReader(options.store).sessions()).row(given.session);
  const std::string file = given.file.string();
  const std::optional<Projection> system = system_of(options);
  ToSite to_site;
  if (system) to_site = [&](const Datum& place) { return system->project(place); };
  if (system && !given.datum.empty()) {
    throw std::runtime_error("--datum: positions of the project are of " + system->system().name);
  }
  const std::vector<PositionRow> rows =
      parse_positions(datasets::read_file(given.file), file, datum_of(given), to_site);
  if (!given.lever.empty() && rows.front().lever) {
    throw std::runtime_error("--lever: " + file + " has its own");
  }
  const AssignedPositions assigned =
      assign_positions(read_session(options, row), rows, lever_of(given), file);
  if (assigned.positions.empty()) {
    throw std::runtime_error(file + ": no position lies within session " + given.session +
                             ", which lasts " + assigned.lasts);
  }
  if (system) warn_of_place(*system, assigned.positions);
  std::string outcome =
      std::to_string(assigned.positions.size()) + " positions of " + given.session;
  if (assigned.left_out > 0) {
    outcome += ", " + std::to_string(assigned.left_out) +
               " left out that lie beside others, in gaps of the session or outside of it";
  }
  state_it(options, "`unimapper map positions`",
           "positions " + given.session + " --file " + file + datum_text(given), outcome,
           {statement_of(row, assigned.positions)});
}

}  // namespace unimapper::apps
