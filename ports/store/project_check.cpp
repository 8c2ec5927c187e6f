// Check of a stored project's invariants (docs/design/store.md).
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "ports/store/loop_outcome_table.hpp"
#include "ports/store/number_bytes.hpp"
#include "ports/store/placement_outcome_table.hpp"
#include "ports/store/project_reader.hpp"
#include "ports/store/transaction.hpp"

namespace unimapper::store {

namespace {

std::string number_text(std::int64_t number) { return std::to_string(number); }

class ProjectCheck {
 public:
  ProjectCheck(Database& database, ProjectReader& reader) : database_(database), reader_(reader) {}

  std::vector<std::string> run() {
    const Snapshot snapshot(database_);
    check_references();
    read_keyframes();
    check_epochs();
    check_results();
    check_outcomes();
    return std::move(faults_);
  }

 private:
  void fault(const std::string& text) { faults_.push_back(text); }
  void require(bool holds, const std::string& text) {
    if (!holds) fault(text);
  }

  void check_references() {
    Statement rows(database_, "PRAGMA foreign_key_check");
    while (rows.step()) {
      fault("a row of " + rows.text(0) + " refers to one of " + rows.text(2) +
            " that is not there");
    }
  }

  /// Keyframes, and summaries that stand for them.
  void read_keyframes() {
    Statement rows(database_,
                   "SELECT session, sequence FROM keyframes UNION SELECT session, sequence FROM "
                   "summaries");
    while (rows.step()) {
      keyframes_.insert({rows.number(0), static_cast<std::uint32_t>(rows.number(1))});
    }
  }

  void check_epochs() {
    std::int64_t before = 0;
    std::int64_t known_before = 0;
    for (const Epoch& epoch : reader_.epochs()) {
      const std::string what = "epoch " + number_text(epoch.number);
      require(epoch.number == before + 1, what + " does not follow on " + number_text(before));
      require(epoch.parent >= 0 && epoch.parent < epoch.number, what + " has no parent");
      require(epoch.known_sessions >= known_before, what + " knows fewer sessions");
      require(!epoch.command.empty() && !epoch.outcome.empty(), what + " does not say what it is");
      if (epoch.result != 0) results_.insert(epoch.result);
      before = epoch.number;
      known_before = epoch.known_sessions;
      if (epoch.purged_by != 0) {
        check_purged(epoch, what);
        continue;
      }
      try {
        check_state(reader_.at(epoch.number), what);
      } catch (const StoreError& error) {
        fault(error.what());
      }
    }
  }

  void check_purged(const Epoch& epoch, const std::string& what) {
    require(epoch.purged_by > epoch.number, what + " was purged by an earlier one");
    Statement rows(database_,
                   "SELECT (SELECT count(*) FROM epoch_sessions WHERE epoch = ?1) + "
                   "(SELECT count(*) FROM epoch_statements WHERE epoch = ?1)");
    rows.bind(epoch.number);
    require(rows.step() && rows.number(0) == 0 && epoch.result == 0,
            what + " was purged and still shows something");
  }

  void check_state(const ProjectState& state, const std::string& what) {
    const std::set<std::int64_t> sessions(state.sessions.begin(), state.sessions.end());
    for (const std::int64_t session : sessions) {
      require(session <= state.epoch.known_sessions, what + " has a session that it doesn't know");
    }
    int references = 0;
    for (const StoredStatement& statement : state.statements) {
      const std::string one = what + ": statement " + number_text(statement.id);
      references += statement.kind == StatementKind::kReference ? 1 : 0;
      check_positions(statement, one);
      const bool is_of_two =
          statement.kind == StatementKind::kLink || statement.kind == StatementKind::kForbidden;
      if (!is_of_two) continue;
      require(keyframes_.count(statement.match) > 0 && keyframes_.count(statement.query) > 0,
              one + " is about a keyframe that is not there");
      require(statement.match != statement.query, one + " is about one keyframe");
      require(!statement.T_match_query || statement.T_match_query->is_rigid(),
              one + " has a pose that is none");
    }
    require(references <= 1, what + " has several reference sessions");
    if (state.epoch.result == 0) return;
    Statement rows(database_, "SELECT session FROM result_sessions WHERE result = ?");
    rows.bind(state.epoch.result);
    while (rows.step()) {
      require(sessions.count(rows.number(0)) > 0, what + " shows a session that is not in it");
    }
  }

  void check_positions(const StoredStatement& statement, const std::string& one) {
    const bool has_positions = !statement.positions.empty();
    require(has_positions == (statement.kind == StatementKind::kPosition),
            one + (has_positions ? " is none of positions and has some" : " has no position"));
    for (const StoredPosition& position : statement.positions) {
      require(keyframes_.count({statement.match.session, position.sequence}) > 0,
              one + " is about a keyframe that is not there");
      require(is_sound(position), one + " has a position that is none");
    }
  }

  template <typename Position>
  static bool is_sound(const Position& position) {
    const auto is_deviation = [](double sigma) { return std::isfinite(sigma) && sigma > 0.0; };
    return position.position.allFinite() && position.point.allFinite() &&
           is_deviation(position.sigma_z_m) &&
           (!position.sigma_xy_m || is_deviation(*position.sigma_xy_m));
  }

  void check_results() {
    require(database_.number("SELECT count(*) FROM results") ==
                static_cast<std::int64_t>(results_.size()),
            "a result belongs to no epoch");
    for (const std::int64_t id : results_) {
      try {
        check_result(reader_.result(id), "result " + number_text(id));
      } catch (const StoreError& error) {
        fault(error.what());
      }
    }
  }

  void check_result(const MapResult& result, const std::string& what) {
    std::map<std::int64_t, std::set<std::uint32_t>> merged;
    int central = 0;
    int connected = 0;
    for (const SessionResult& session : result.sessions) {
      const std::string one = what + ", session " + number_text(session.session);
      const bool is_central = session.state == "central";
      const bool is_merged = session.state == "merged";
      const bool is_apart = session.state == "provisional" || session.state == "unconnected";
      require(is_central || is_merged || is_apart, one + " has no state");
      require(!is_apart || !session.reason.empty(), one + " is apart without a reason");
      central += is_central ? 1 : 0;
      connected += is_central || is_merged ? 1 : 0;
      require(session.T_map_session.is_rigid(), one + " has an anchor that is no pose");
      std::set<std::uint32_t>& sequences = merged[session.session];
      require(sequences.empty(), one + " is there twice");
      for (std::size_t k = 0; k < session.sequences.size(); ++k) {
        require(session.T_map_keyframe[k].is_rigid(), one + " has a pose that is none");
        require(sequences.empty() || session.sequences[k] > *sequences.rbegin(),
                one + " has keyframes out of order");
        require(keyframes_.count({session.session, session.sequences[k]}) > 0,
                one + " has a keyframe that is not stored");
        sequences.insert(session.sequences[k]);
      }
    }
    require(central == 1 || connected == 0, what + " has not one central session");
    for (const LoopResult& loop : result.loops) {
      const auto is_merged = [&](const KeyframeRow& keyframe) {
        const auto session = merged.find(keyframe.session);
        return session != merged.end() && session->second.count(keyframe.sequence) > 0;
      };
      require(is_merged(loop.query) && is_merged(loop.match),
              what + " has a loop of a keyframe that is not in it");
      require(loop.T_match_query.is_rigid(1e-2) || !loop.accepted,
              what + " has a loop whose pose is none");
      require(!loop.accepted || loop.information.allFinite(),
              what + " has a loop without information");
      require(!loop.reason.empty(), what + " has a loop without a reason");
    }
    bool is_any_used = false;
    for (const PositionResult& position : result.positions) {
      const auto session = merged.find(position.keyframe.session);
      require(session != merged.end() && session->second.count(position.keyframe.sequence) > 0,
              what + " has a position of a keyframe that is not in it");
      require(is_sound(position) && position.residual.allFinite(),
              what + " has a position that is none");
      require(position.used == position.reason.empty(), what + " has a position without a reason");
      is_any_used = is_any_used || position.used;
    }
    require(is_any_used == result.georeference.has_value(),
            what + " has a wrong place in the site");
    for (const PairResult& pair : result.pairs) {
      require(merged.count(pair.match) > 0 && merged.count(pair.query) > 0,
              what + " has a pair with a session that is not in it");
      require((pair.state == "confirmed") == pair.reason.empty(),
              what + " has a pair with a wrong reason");
      require(pair.T_match_query.is_rigid(), what + " has a pair whose pose is none");
    }
  }

  void check_outcomes() {
    Statement rows(
        database_,
        "SELECT pose, information, accepted, reason, crc32, length(proposed), overlap FROM "
        "loop_outcomes");
    std::int64_t damaged = 0;
    while (rows.step()) {
      const bool is_sound = checksum_of(rows.bytes(0), rows.bytes(1), rows.real(6),
                                        rows.number(2) != 0, rows.text(3)) == rows.number(4) &&
                            rows.bytes(0).size() == 96 && rows.bytes(1).size() == 288 &&
                            rows.number(5) == 96;
      damaged += is_sound ? 0 : 1;
    }
    require(damaged == 0, number_text(damaged) + " outcomes of loops are damaged");
    const std::int64_t placements = damaged_placement_outcomes(database_);
    require(placements == 0, number_text(placements) + " outcomes of placements are damaged");
  }

  Database& database_;
  ProjectReader& reader_;
  std::set<KeyframeRow> keyframes_;
  std::set<std::int64_t> results_;
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<std::string> ProjectReader::check() { return ProjectCheck(database_, *this).run(); }

}  // namespace unimapper::store
