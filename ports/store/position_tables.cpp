#include "ports/store/position_tables.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "ports/store/number_bytes.hpp"

namespace unimapper::store {
namespace {

Bytes bytes_of(const Eigen::Vector3d& vector) {
  return to_bytes(std::span<const double>(vector.data(), 3));
}

Eigen::Vector3d vector_of(const Database& database, std::span<const std::uint8_t> bytes) {
  const auto numbers = to_doubles(bytes);
  if (!numbers || numbers->size() != 3) {
    throw StoreError(database.file().string() + ": a known position is damaged");
  }
  return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

std::optional<double> real_of(const Statement& row, int column) {
  return row.is_null(column) ? std::nullopt : std::optional(row.real(column));
}

/// Columns position, point, sigma_xy and sigma_z, from the first on.
template <typename Position>
void read_position(const Database& database, const Statement& row, int first, Position& position) {
  position.position = vector_of(database, row.bytes(first));
  position.point = vector_of(database, row.bytes(first + 1));
  position.sigma_xy_m = real_of(row, first + 2);
  position.sigma_z_m = row.real(first + 3);
}

}  // namespace

void keep_positions(Database& database, const StoredStatement& statement) {
  // A deviation that is not known is NULL.
  Statement insert(database,
                   "INSERT INTO statement_positions (statement, sequence, position, point, "
                   "sigma_xy, sigma_z) VALUES (?, ?, ?, ?, nullif(?, -1.0), ?)");
  for (const StoredPosition& position : statement.positions) {
    const Bytes at = bytes_of(position.position);
    const Bytes point = bytes_of(position.point);
    insert.bind(statement.id, std::int64_t{position.sequence}, at, point,
                position.sigma_xy_m.value_or(-1.0), position.sigma_z_m);
    insert.run();
  }
}

void keep_positions(Database& database, std::int64_t id, const MapResult& result) {
  Statement insert(database,
                   "INSERT INTO result_positions (result, number, session, sequence, position, "
                   "point, sigma_xy, sigma_z, used, reason, residual) "
                   "VALUES (?, ?, ?, ?, ?, ?, nullif(?, -1.0), ?, ?, ?, ?)");
  std::int64_t number = 0;
  for (const PositionResult& position : result.positions) {
    const Bytes at = bytes_of(position.position);
    const Bytes point = bytes_of(position.point);
    const Bytes residual = bytes_of(position.residual);
    insert.bind(id, number++, position.keyframe.session, std::int64_t{position.keyframe.sequence},
                at, point, position.sigma_xy_m.value_or(-1.0), position.sigma_z_m,
                std::int64_t{position.used ? 1 : 0}, position.reason, residual);
    insert.run();
  }
  if (!result.georeference) return;
  const Bytes origin = bytes_of(result.georeference->origin);
  Statement(database,
            "INSERT INTO result_georeferences (result, origin, horizontal, heading_sigma) "
            "VALUES (?, ?, ?, nullif(?, -1.0))")
      .bind(id, origin, std::int64_t{result.georeference->is_horizontal ? 1 : 0},
            result.georeference->heading_sigma_rad.value_or(-1.0))
      .run();
}

void read_positions(Database& database, ProjectState& state) {
  Statement rows(database,
                 "SELECT statement, sequence, position, point, sigma_xy, sigma_z FROM "
                 "statement_positions JOIN epoch_statements USING (statement) WHERE epoch = ? "
                 "ORDER BY statement, sequence");
  rows.bind(state.epoch.number);
  std::map<std::int64_t, StoredStatement*> statements;
  for (StoredStatement& statement : state.statements) statements[statement.id] = &statement;
  while (rows.step()) {
    const auto found = statements.find(rows.number(0));
    if (found == statements.end()) continue;
    StoredPosition& position = found->second->positions.emplace_back();
    position.sequence = static_cast<std::uint32_t>(rows.number(1));
    read_position(database, rows, 2, position);
  }
}

void read_positions(Database& database, std::int64_t id, MapResult& result) {
  Statement rows(database,
                 "SELECT session, sequence, position, point, sigma_xy, sigma_z, used, reason, "
                 "residual FROM result_positions WHERE result = ? ORDER BY number");
  rows.bind(id);
  while (rows.step()) {
    PositionResult& position = result.positions.emplace_back();
    position.keyframe = {rows.number(0), static_cast<std::uint32_t>(rows.number(1))};
    read_position(database, rows, 2, position);
    position.used = rows.number(6) != 0;
    position.reason = rows.text(7);
    position.residual = vector_of(database, rows.bytes(8));
  }
  Statement row(database,
                "SELECT origin, horizontal, heading_sigma FROM result_georeferences WHERE result "
                "= ?");
  row.bind(id);
  if (!row.step()) return;
  GeoreferenceResult& georeference = result.georeference.emplace();
  georeference.origin = vector_of(database, row.bytes(0));
  georeference.is_horizontal = row.number(1) != 0;
  georeference.heading_sigma_rad = real_of(row, 2);
}

}  // namespace unimapper::store
