// Surveys as sessions of a stored project.
#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <string>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/store/project_writer.hpp"
#include "ports/store/session_import.hpp"
#include "src/apps/map/map_options.hpp"
#include "src/apps/map/statements.hpp"
#include "src/apps/survey/survey_keyframes.hpp"
#include "src/apps/survey/viewpoints.hpp"

namespace unimapper::apps {
namespace {

using store::StatementKind;
using store::StoredStatement;

/// Of a viewpoint: that of the loops that join it is some centimetres.
constexpr double kViewpointSigmaM = 0.01;

/// Where the viewpoints are, in the frame of the survey.
StoredStatement positions_of(std::int64_t session, const std::vector<Eigen::Vector3f>& places) {
  StoredStatement statement;
  statement.kind = StatementKind::kPosition;
  statement.match.session = session;
  for (const Eigen::Vector3f& place : places) {
    store::StoredPosition& position = statement.positions.emplace_back();
    position.sequence = static_cast<std::uint32_t>(statement.positions.size() - 1);
    position.position = place.cast<double>();
    position.sigma_xy_m = kViewpointSigmaM;
    position.sigma_z_m = kViewpointSigmaM;
  }
  return statement;
}

/// What is said of a survey that has just come in, for the first time or again.
void state_survey(store::ProjectState& state, std::int64_t session,
                  const std::vector<Eigen::Vector3f>& places, bool is_placed) {
  const auto has = [&](StatementKind kind) {
    return std::any_of(state.statements.begin(), state.statements.end(),
                       [kind](const StoredStatement& s) { return s.kind == kind; });
  };
  if (!has(StatementKind::kReference)) {
    StoredStatement reference;
    reference.kind = StatementKind::kReference;
    reference.match.session = session;
    state.statements.push_back(reference);
  }
  std::erase_if(state.statements, [session](const StoredStatement& s) {
    return s.kind == StatementKind::kPosition && s.match.session == session;
  });
  if (!is_placed) return;
  if (has(StatementKind::kPosition)) {
    std::cerr << "unimapper: warning: the project has known positions: the survey's coordinates "
                 "must be of the same site frame; else take it out and use --unplaced\n";
  }
  state.statements.push_back(positions_of(session, places));
}

/// The session of a survey, written in the transaction that is open.
store::ImportedSession import_survey(store::ProjectWriter& writer, const SurveyOptions& survey,
                                     const SessionId& id, const PointTiles& tiles,
                                     const std::vector<Eigen::Vector3f>& places) {
  store::SessionImport import(writer.database());
  make_survey_keyframes(tiles, id, places, static_cast<float>(survey.range_m),
                        [&](wire::ReceivedKeyframe&& keyframe) {
                          (void)import.keep(std::move(keyframe));
                          if (!import.trouble().empty()) {
                            throw std::runtime_error(import.trouble());
                          }
                        });
  const std::string name = survey.name.empty() ? survey.file.stem().string() : survey.name;
  import.keep(wire::SessionSummary{id, SessionInfo{id, name, "survey"}, true, places.size(), 0});
  import.name(id, name);
  if (!import.trouble().empty()) throw std::runtime_error(import.trouble());
  return import.sessions().at(id);
}

}  // namespace

void add_survey(const ProjectOptions& options, const SurveyOptions& survey) {
  store::ProjectWriter writer(options.store, "`unimapper map survey`");
  SurveyCloud cloud = parse_survey(datasets::read_file(survey.file), survey.file);
  if (cloud.not_finite > 0) {
    std::cerr << "unimapper: warning: " << survey.file.string() << ": " << cloud.not_finite
              << " points are not finite and left out\n";
  }
  const auto places = viewpoints(cloud.points, {survey.spacing_m, survey.height_m});
  if (places.empty()) {
    throw std::runtime_error(survey.file.string() +
                             ": has no ground on which a sensor could stand; z must point up");
  }
  const PointTiles tiles(std::move(cloud.points));
  say_epoch(writer.commit("survey " + survey.file.string(),
                          [&](store::ProjectState& state) -> std::optional<std::string> {
                            const auto session =
                                import_survey(writer, survey, cloud.id, tiles, places);
                            const std::string text = take_in(state, session);
                            if (text.empty()) return std::nullopt;
                            state_survey(state, session.row, places, !survey.is_unplaced);
                            return "added the survey " + text;
                          }));
}

}  // namespace unimapper::apps
