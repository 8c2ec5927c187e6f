#include "ports/store/loop_outcome_table.hpp"

#include <algorithm>
#include <span>

#include "ports/store/number_bytes.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

std::int64_t checksum_of(std::span<const std::uint8_t> pose,
                         std::span<const std::uint8_t> information, double overlap, bool accepted,
                         const std::string& reason) {
  Bytes all(pose.begin(), pose.end());
  all.insert(all.end(), information.begin(), information.end());
  const Bytes measure = to_bytes(std::span(&overlap, 1));
  all.insert(all.end(), measure.begin(), measure.end());
  all.push_back(accepted ? 1 : 0);
  all.insert(all.end(), reason.begin(), reason.end());
  return std::int64_t{wire::crc32(all)};
}

LoopOutcomeTable::LoopOutcomeTable(const Database& database)
    : find_(database,
            "SELECT pose, information, overlap, accepted, reason, crc32 FROM loop_outcomes WHERE "
            "query_session = ? AND query_sequence = ? AND match_session = ? AND "
            "match_sequence = ? AND fingerprint = ? AND proposed = ?"),
      insert_(database,
              "INSERT INTO loop_outcomes (query_session, query_sequence, match_session, "
              "match_sequence, fingerprint, proposed, pose, information, overlap, accepted, "
              "reason, crc32) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING") {
}

std::optional<LoopResult> LoopOutcomeTable::find(const LoopKey& key) {
  const Bytes proposed = to_bytes(std::span(&key.proposed, 1));
  find_.bind(key.query.session, std::int64_t{key.query.sequence}, key.match.session,
             std::int64_t{key.match.sequence}, to_integer(key.fingerprint), proposed);
  if (!find_.step()) return std::nullopt;
  LoopResult loop;
  loop.query = key.query;
  loop.match = key.match;
  loop.overlap = find_.real(2);
  loop.accepted = find_.number(3) != 0;
  loop.reason = find_.text(4);
  const auto pose = to_poses(find_.bytes(0));
  const auto information = to_doubles(find_.bytes(1));
  const bool is_sound = pose && pose->size() == 1 && information && information->size() == 36 &&
                        checksum_of(find_.bytes(0), find_.bytes(1), loop.overlap, loop.accepted,
                                    loop.reason) == find_.number(5);
  find_.reset();
  if (!is_sound) return std::nullopt;
  loop.T_match_query = pose->front();
  std::copy(information->begin(), information->end(), loop.information.data());
  return loop;
}

void LoopOutcomeTable::keep(const LoopKey& key, const LoopResult& outcome) {
  const Bytes proposed = to_bytes(std::span(&key.proposed, 1));
  const Bytes pose = to_bytes(std::span(&outcome.T_match_query, 1));
  const Bytes information = to_bytes(std::span<const double>(outcome.information.data(), 36));
  insert_.bind(key.query.session, std::int64_t{key.query.sequence}, key.match.session,
               std::int64_t{key.match.sequence}, to_integer(key.fingerprint), proposed, pose,
               information, outcome.overlap, std::int64_t{outcome.accepted ? 1 : 0}, outcome.reason,
               checksum_of(pose, information, outcome.overlap, outcome.accepted, outcome.reason));
  insert_.run();
}

}  // namespace unimapper::store
