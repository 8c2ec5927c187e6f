#include "src/apps/map/project_merge.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "ports/store/transaction.hpp"
#include "src/apps/map/known_positions.hpp"
#include "src/apps/map/stored_result.hpp"
#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/merge/jobs/loop_job.hpp"
#include "src/merge/loops/link_check.hpp"

namespace unimapper::apps {
namespace {

using store::StatementKind;

/// The store's tables of outcomes, for a merge. What is kept is on the disk at once: a merge that
/// is killed has not verified in vain.
class StoredOutcomes final : public merge::LoopOutcomes {
 public:
  StoredOutcomes(store::ProjectWriter& writer, const KeyframeRows& rows,
                 const VerifyElsewhere& elsewhere)
      : writer_(writer), rows_(rows), elsewhere_(elsewhere) {}

  std::optional<merge::LoopConstraint> find(const merge::LoopQuestion& question) override {
    const auto stored = writer_.outcomes().find(key_of(question));
    if (!stored) return std::nullopt;
    ++found_;
    return from_stored(*stored, question.query, question.match);
  }
  std::vector<merge::LoopConstraint> verify(std::span<const merge::LoopQuestion> questions,
                                            const merge::CorrectionLimit& limit,
                                            const merge::VerifyHere& verify_here) override {
    if (elsewhere_ && !questions.empty()) return elsewhere_(rows_, questions, limit, verify_here);
    return merge::LoopOutcomes::verify(questions, limit, verify_here);
  }
  void keep(std::span<const Entry> entries) override {
    store::Transaction transaction(writer_.database());
    for (const Entry& entry : entries) {
      // It may be the workers' fault: the next merge tries again.
      if (entry.outcome.decision.reason == merge::kSetAside) continue;
      writer_.outcomes().keep(key_of(entry.question), to_stored(entry.outcome, rows_));
    }
    transaction.commit();
    kept_ += entries.size();
  }
  std::optional<merge::PlacementEvidence> find(const merge::PlacementQuestion& question) override {
    auto stored = writer_.placements().find(key_of(question));
    if (!stored) return std::nullopt;
    ++placements_found_;
    return merge::PlacementEvidence{stored->supporting, stored->contradicting,
                                    std::move(stored->aliasing)};
  }
  void keep(const merge::PlacementQuestion& question,
            const merge::PlacementEvidence& evidence) override {
    store::Transaction transaction(writer_.database());
    writer_.placements().keep(key_of(question),
                              {evidence.supporting, evidence.contradicting, evidence.aliasing});
    transaction.commit();
    ++placements_kept_;
  }
  [[nodiscard]] std::string text() const {
    return std::to_string(kept_) + " loops verified, " + std::to_string(found_) +
           " known from before; " + std::to_string(placements_kept_) + " placements checked, " +
           std::to_string(placements_found_) + " known from before";
  }

 private:
  [[nodiscard]] store::LoopKey key_of(const merge::LoopQuestion& question) const {
    return {rows_.row(question.query), rows_.row(question.match), question.T_match_query,
            question.fingerprint};
  }
  [[nodiscard]] store::PlacementKey key_of(const merge::PlacementQuestion& question) const {
    return {rows_.session(question.query), rows_.session(question.match), question.fingerprint};
  }

  store::ProjectWriter& writer_;
  const KeyframeRows& rows_;
  const VerifyElsewhere& elsewhere_;
  std::size_t found_ = 0;
  std::size_t kept_ = 0;
  std::size_t placements_found_ = 0;
  std::size_t placements_kept_ = 0;
};

/// Pose between levelled keyframe frames of one between the sensors.
Pose between_keyframes(const Pose& T_match_query_sensor, const KeyframeRecord& match,
                       const KeyframeRecord& query) {
  return merge::reference_sensor_pose(match) * T_match_query_sensor *
         merge::reference_sensor_pose(query).inverse();
}

/// What people said of the sessions that are merged; what is about others waits until they are.
merge::UserStatements statements_of(const store::ProjectState& state, const KeyframeRows& rows,
                                    const std::vector<SessionData>& sessions) {
  merge::UserStatements said;
  said.positions = positions_of(state, rows);
  for (const store::StoredStatement& statement : state.statements) {
    const std::optional<std::uint32_t> session = rows.index(statement.match.session);
    const std::optional<KeyframeId> match = rows.find(statement.match);
    const std::optional<KeyframeId> query = rows.find(statement.query);
    switch (statement.kind) {
      case StatementKind::kPosition:
        break;
      case StatementKind::kApart:
        if (session) said.apart.push_back(*session);
        break;
      case StatementKind::kReference:
        if (session) said.reference = *session;
        break;
      case StatementKind::kForbidden:
        if (match && query) said.forbidden.push_back({*query, *match});
        break;
      case StatementKind::kLink:
        if (!match || !query) break;
        said.links.push_back({*query, *match, std::nullopt});
        if (statement.T_match_query) {
          said.links.back().T_match_query = between_keyframes(
              *statement.T_match_query, sessions[match->session].keyframes[match->keyframe],
              sessions[query->session].keyframes[query->keyframe]);
        }
        break;
    }
  }
  return said;
}

std::string positions_text(const merge::MergeResult& result) {
  if (result.positions.empty()) return {};
  const auto used = std::count_if(result.positions.begin(), result.positions.end(),
                                  [](const merge::PositionOutcome& p) { return p.used; });
  std::string text = " and " + std::to_string(used) + " of " +
                     std::to_string(result.positions.size()) + " known positions";
  if (!result.georeference) return text;
  if (!result.georeference->is_horizontal) return text + " (heights only)";
  if (std::isfinite(result.georeference->heading_sigma_rad)) return text;
  return text + " (which leave the heading unknown)";
}

std::string outcome_of(const merge::MergeResult& result, const std::vector<SessionData>& sessions) {
  std::size_t connected = 0;
  std::string apart;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const merge::MergedSession& merged = result.sessions[s];
    if (merge::is_in_map(merged.status)) {
      ++connected;
    } else {
      apart += "; " + sessions[s].info.name + " is " + merge::status_name(merged.status) + ": " +
               merged.reason;
    }
  }
  std::size_t accepted = 0;
  for (const auto& loop : result.loops) accepted += loop.decision.accepted ? 1 : 0;
  return "merged " + std::to_string(connected) + " of " + std::to_string(sessions.size()) +
         " sessions by " + std::to_string(accepted) + " loops" + positions_text(result) +
         merge::drift_text(sessions, result) + apart;
}

}  // namespace

ProjectResult merge_held(store::ProjectWriter& writer, const store::ProjectState& state,
                         const KeyframeRows& rows, const merge::MergeConfig& config,
                         std::optional<std::int64_t> reference, const MergePoses& merge_poses,
                         const VerifyElsewhere& elsewhere) {
  ProjectResult merge;
  StoredOutcomes outcomes(writer, rows, elsewhere);
  merge::UserStatements said = statements_of(state, rows, rows.sessions());
  if (!said.reference && reference) said.reference = rows.index(*reference);
  merge.result = merge_poses(said, outcomes);
  merge.stored = to_stored(merge.result, rows, config);
  merge.outcome = outcome_of(merge.result, rows.sessions());
  merge.verified = outcomes.text();
  return merge;
}

ProjectMerge merge_stored(store::ProjectWriter& writer, const std::filesystem::path& store,
                          const store::ProjectState& state, const merge::MergeConfig& config,
                          const std::function<void(const std::string&)>& progress,
                          std::optional<std::int64_t> reference, const VerifyElsewhere& elsewhere) {
  ProjectMerge merge;
  StoredContents contents(config.kept_bytes());
  std::vector<InputSession> inputs = read_sessions(store, state.sessions, {}, &contents);
  for (const InputSession& input : inputs) {
    merge.rows.push_back(input.row);
  }
  merge.sessions = data_of(inputs);
  const KeyframeRows rows(merge.rows, merge.sessions);
  static_cast<ProjectResult&>(merge) = merge_held(
      writer, state, rows, config, reference,
      [&](const merge::UserStatements& said, merge::LoopOutcomes& outcomes) {
        return merge::merge_poses(merge.sessions, config, progress, said, &outcomes);
      },
      elsewhere);
  return merge;
}

std::string objection_to(const std::filesystem::path& store, const store::StoredStatement& link) {
  const merge::MergeConfig config;
  StoredContents contents(config.kept_bytes());
  std::vector<std::int64_t> rows{link.match.session};
  if (link.query.session != link.match.session) rows.push_back(link.query.session);
  std::vector<InputSession> inputs = read_sessions(store, rows, {}, &contents);
  rows.clear();
  for (const InputSession& input : inputs) rows.push_back(input.row);
  const std::vector<SessionData> sessions = data_of(inputs);
  store::ProjectState state;
  state.statements.push_back(link);
  const merge::UserStatements said = statements_of(state, KeyframeRows(rows, sessions), sessions);
  if (said.links.empty()) return "the store has not all of both keyframes";
  const merge::LinkEvidence found = merge::check_link(sessions, said.links.front(), config);
  if (found.is_confirmed) return {};
  if (!link.T_match_query) return "the scans of the two do not fit at one position: say --pose";
  if (!found.is_contradicted) return {};
  return "the scans contradict it: of the structure that both could see there " +
         std::to_string(std::lround(100.0 * found.seen_through)) + " % was seen through";
}

}  // namespace unimapper::apps
