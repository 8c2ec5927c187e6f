// Merges of a stored project, and exports of their results.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/store/project_writer.hpp"
#include "ports/store/transaction.hpp"
#include "src/apps/export_options.hpp"
#include "src/apps/map/options.hpp"
#include "src/apps/map/stored_map.hpp"
#include "src/apps/map/stored_result.hpp"
#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/output_guard.hpp"
#include "src/apps/replacement.hpp"
#include "src/apps/report.hpp"
#include "src/apps/scene/result_scene.hpp"
#include "src/apps/session_clouds.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {
namespace {

using store::StatementKind;

/// The store's table of outcomes, for a merge. What is kept is on the disk at once: a merge that is
/// killed has not verified in vain.
class StoredOutcomes final : public merge::LoopOutcomes {
 public:
  StoredOutcomes(store::ProjectWriter& writer, const KeyframeRows& rows)
      : writer_(writer), rows_(rows) {}

  std::optional<merge::LoopConstraint> find(const merge::LoopQuestion& question) override {
    const auto stored = writer_.outcomes().find(key_of(question));
    if (!stored) return std::nullopt;
    ++found_;
    return from_stored(*stored, question.query, question.match);
  }
  void keep(std::span<const Entry> entries) override {
    store::Transaction transaction(writer_.database());
    for (const Entry& entry : entries) {
      writer_.outcomes().keep(key_of(entry.question), to_stored(entry.outcome, rows_));
    }
    transaction.commit();
    kept_ += entries.size();
  }
  [[nodiscard]] std::string text() const {
    return std::to_string(kept_) + " loops verified, " + std::to_string(found_) +
           " known from before";
  }

 private:
  [[nodiscard]] store::LoopKey key_of(const merge::LoopQuestion& question) const {
    return {rows_.row(question.query), rows_.row(question.match), question.T_match_query,
            question.fingerprint};
  }

  store::ProjectWriter& writer_;
  const KeyframeRows& rows_;
  std::size_t found_ = 0;
  std::size_t kept_ = 0;
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
  for (const store::StoredStatement& statement : state.statements) {
    const std::optional<std::uint32_t> session = rows.index(statement.match.session);
    const std::optional<KeyframeId> match = rows.find(statement.match);
    const std::optional<KeyframeId> query = rows.find(statement.query);
    switch (statement.kind) {
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

/// Stages and outcomes with the time since the start.
std::function<void(const std::string&)> progress() {
  const auto start = std::chrono::steady_clock::now();
  return [start](const std::string& text) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    char seconds[24];
    std::snprintf(seconds, sizeof seconds, "%6.1f s", elapsed.count());
    std::cerr << "unimapper: " << seconds << "  " << text << std::endl;
  };
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
         " sessions by " + std::to_string(accepted) + " loops" + apart;
}

}  // namespace

void merge_project(const ProjectOptions& options, const MapMergeOptions& merge_options) {
  merge::MergeConfig config;
  if (!merge_options.config.empty()) {
    parse_config(datasets::read_file(merge_options.config), merge_options.config.string(), config);
  }
  if (merge_options.threads) config.threads = *merge_options.threads;
  store::ProjectWriter writer(options.store, "`unimapper map merge`");
  const store::ProjectState state = writer.current();
  if (state.sessions.empty()) {
    throw std::runtime_error("the project has no session; `unimapper map add` takes runs in");
  }
  std::vector<InputSession> inputs = read_sessions(options.store, state.sessions);
  const std::vector<SessionData> sessions = data_of(inputs);
  const KeyframeRows rows(inputs, sessions);
  StoredOutcomes outcomes(writer, rows);
  const merge::MergeResult result = merge::merge_poses(
      sessions, config, progress(), statements_of(state, rows, sessions), &outcomes);
  std::cerr << "unimapper: " << outcomes.text() << '\n';
  const auto epoch = writer.commit("merge", [&](store::ProjectState& next) {
    next.epoch.result = writer.keep(to_stored(result, rows, config));
    return std::optional(outcome_of(result, sessions));
  });
  std::cout << "epoch " << epoch->number << ": " << epoch->outcome << '\n';
}

void export_project(const ProjectOptions& options, const MapExportOptions& output) {
  check_output_folder(output.out, Output::kMap, output.replaces);
  if (!output.mcap.empty()) check_output_file(output.mcap, output.replaces);
  FolderReplacement folder(output.out, Output::kMap);
  std::optional<FileReplacement> scene;
  if (!output.mcap.empty()) scene.emplace(output.mcap);
  StoredMap map = read_stored_map(options.store, options.epoch);
  const std::vector<SessionData>& sessions = map.sessions;
  const merge::MergeResult result =
      merge::complete_merge(sessions, std::move(map.posed), map.config, progress());

  report_grid(merge::export_map(folder.path(), sessions, result, output.output));
  write_session_clouds(folder.path(), sessions, result);
  if (scene) write_scene(scene->path(), scene_of_merge(sessions, result));
  ReportInput report;
  report.references.resize(sessions.size());
  report.sessions = &sessions;
  report.result = &result;
  write_report(folder.path() / "report.html", report);
  folder.publish();
  if (scene) scene->publish();
  std::cerr << "unimapper: the map of epoch " << map.epoch << " is in " << output.out.string()
            << '\n';
}

}  // namespace unimapper::apps
