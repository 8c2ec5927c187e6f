#include "ports/store/placement_outcome_table.hpp"

#include "ports/store/number_bytes.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

/// The first columns of every query.
constexpr const char* kEvidence = "SELECT supporting, contradicting, aliasing, crc32 FROM ";

/// Of what a row holds beside its key.
std::int64_t checksum_of_evidence(const PlacementResult& evidence) {
  Bytes all;
  wire::BigEndianWriter writer(all);
  writer.put(evidence.supporting);
  writer.put(evidence.contradicting);
  all.insert(all.end(), evidence.aliasing.begin(), evidence.aliasing.end());
  return std::int64_t{wire::crc32(all)};
}

/// Nothing of a row that is damaged.
std::optional<PlacementResult> evidence_in(const Statement& row) {
  const PlacementResult evidence{static_cast<std::uint64_t>(row.number(0)),
                                 static_cast<std::uint64_t>(row.number(1)), row.text(2)};
  if (checksum_of_evidence(evidence) != row.number(3)) return std::nullopt;
  return evidence;
}

}  // namespace

PlacementOutcomeTable::PlacementOutcomeTable(const Database& database)
    : find_(database, std::string(kEvidence) +
                          "placement_outcomes WHERE query_session = ? AND match_session = ? AND "
                          "fingerprint = ?"),
      insert_(database,
              "INSERT INTO placement_outcomes (query_session, match_session, fingerprint, "
              "supporting, contradicting, aliasing, crc32) VALUES (?, ?, ?, ?, ?, ?, ?) "
              "ON CONFLICT DO NOTHING") {}

std::optional<PlacementResult> PlacementOutcomeTable::find(const PlacementKey& key) {
  find_.bind(key.query, key.match, to_integer(key.fingerprint));
  if (!find_.step()) return std::nullopt;
  auto evidence = evidence_in(find_);
  find_.reset();
  return evidence;
}

void PlacementOutcomeTable::keep(const PlacementKey& key, const PlacementResult& evidence) {
  insert_.bind(key.query, key.match, to_integer(key.fingerprint), to_integer(evidence.supporting),
               to_integer(evidence.contradicting), evidence.aliasing,
               checksum_of_evidence(evidence));
  insert_.run();
}

std::int64_t damaged_placement_outcomes(Database& database) {
  Statement rows(database, std::string(kEvidence) + "placement_outcomes");
  std::int64_t damaged = 0;
  while (rows.step()) damaged += evidence_in(rows) ? 0 : 1;
  return damaged;
}

}  // namespace unimapper::store
