#include "src/apps/evaluate/json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;
using evaluate::Tally;

/// JSON has no NaN: an undefined figure is null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json percent(double share) { return number(100.0 * share); }

std::string document(const Json& json) { return json.dump(2) + "\n"; }

Json accuracies(const Tally& tally) {
  return {{"SA", percent(tally.static_accuracy())},     {"DA", percent(tally.dynamic_accuracy())},
          {"AA", percent(tally.associated_accuracy())}, {"HA", percent(tally.harmonic_accuracy())},
          {"static_points", tally.static_points},       {"static_kept", tally.static_kept},
          {"dynamic_points", tally.dynamic_points},     {"dynamic_removed", tally.dynamic_removed}};
}

Json dynamic_accuracy(const Tally& tally) {
  return {{"DA", percent(tally.dynamic_accuracy())},
          {"dynamic_points", tally.dynamic_points},
          {"dynamic_removed", tally.dynamic_removed}};
}

Json dynamic_figures(const evaluate::DynamicScore& score) {
  Json json = accuracies(score.total);
  json["ignored_points"] = score.ignored;
  Json& classes = json["by_class"] = Json::object();
  for (std::size_t c = 0; c < evaluate::kClassCount; ++c) {
    const Tally& tally = score.by_class[c];
    if (tally.static_points + tally.dynamic_points == 0) continue;
    classes[std::string(evaluate::class_name(c))] = accuracies(tally);
  }
  Json& ranges = json["by_range_m"] = Json::object();
  for (std::size_t b = 0; b < evaluate::kRangeBinCount; ++b) {
    ranges[evaluate::range_bin_name(b)] = accuracies(score.by_range[b]);
  }
  return json;
}

Json since_motion_figures(const evaluate::SinceMotionScore& score) {
  Json json = dynamic_figures(score.since);
  json["moving"] = dynamic_accuracy(score.moving);
  json["paused"] = dynamic_accuracy(score.paused);
  json["before"] = dynamic_accuracy(score.before);
  return json;
}

void add_loop_figures(Json& json, const evaluate::LoopFigures& figures, const std::string& suffix,
                      bool curve) {
  const evaluate::PrecisionRecall& point = figures.operating_point;
  json["precision" + suffix] = number(point.precision);
  json["recall" + suffix] = number(point.recall);
  json["f1" + suffix] = number(point.f1);
  json["f1_max" + suffix] = number(figures.f1_max);
  json["auc" + suffix] = number(figures.auc);
  json["recall_at_full_precision" + suffix] = number(figures.recall_at_full_precision);
  json["true_positives" + suffix] = point.true_positives;
  json["false_positives" + suffix] = point.false_positives;
  json["false_negatives" + suffix] = point.false_negatives;
  if (!curve) return;
  Json& points = json["curve" + suffix] = Json::array();
  for (const evaluate::CurvePoint& p : figures.curve) {
    points.push_back(
        {{"confidence", p.confidence}, {"precision", p.precision}, {"recall", p.recall}});
  }
}

Json error_figures(const evaluate::ErrorStatistics& s) {
  return {{"max", s.max}, {"mean", s.mean}, {"median", s.median},
          {"min", s.min}, {"rmse", s.rmse}, {"std", s.std}};
}

ChangeKind change_of(const std::string& name) {
  const auto kind = std::find_if(std::begin(kChangeKinds), std::end(kChangeKinds),
                                 [&](ChangeKind k) { return name == kind_name(k); });
  if (kind != std::end(kChangeKinds)) return *kind;
  throw std::runtime_error("\"" + name + "\" is no kind of change");
}

UprightBox box_of(const Json& json) {
  const auto centre = json.at("centre").get<std::vector<double>>();
  const auto size = json.at("size").get<std::vector<double>>();
  return {{centre.at(0), centre.at(1), centre.at(2)},
          json.at("yaw").get<double>(),
          {size.at(0), size.at(1), size.at(2)}};
}

Json describe(const UprightBox& box) {
  return {{"centre", {box.centre.x(), box.centre.y(), box.centre.z()}},
          {"yaw", box.yaw_rad},
          {"size", {box.size.x(), box.size.y(), box.size.z()}}};
}

}  // namespace

std::string dynamic_json(const EvaluateDynamicOptions& options, std::size_t scans,
                         const evaluate::DynamicScore& points, const evaluate::MotionScore& motion,
                         const std::optional<evaluate::SinceMotionScore>& since_motion,
                         const evaluate::BenchmarkScore& benchmark) {
  Json json = dynamic_figures(points);
  json["moving"] = dynamic_accuracy(motion.moving);
  json["standing"] = dynamic_accuracy(motion.standing);
  Json& moving_classes = json["moving_by_class"] = Json::object();
  for (std::size_t c = 0; c < evaluate::kClassCount; ++c) {
    const Tally& tally = motion.moving_by_class[c];
    if (tally.dynamic_points == 0) continue;
    moving_classes[std::string(evaluate::class_name(c))] = dynamic_accuracy(tally);
  }
  json["since_motion"] = since_motion ? since_motion_figures(*since_motion) : Json();
  json["unit"] = "percent";
  json["scans"] = scans;
  Json& bench = json["benchmark"] = dynamic_figures(benchmark.score);
  bench["with_unlabelled"] = accuracies(benchmark.with_unlabelled);
  bench["neighbour_m"] = options.neighbour_m;
  bench["max_range_m"] = options.max_range_m;
  return document(json);
}

std::string loops_json(const EvaluateLoopsOptions& options, const evaluate::LoopScore& score) {
  Json json;
  add_loop_figures(json, score.by_distance, "", options.curve);
  add_loop_figures(json, score.by_pose, "_pose", options.curve);
  const evaluate::ErrorStatistics& t = score.translation_error_m;
  const evaluate::ErrorStatistics& r = score.rotation_error_deg;
  json["median_translation_error_m"] = t.count > 0 ? Json(t.median) : Json();
  json["median_rotation_error_deg"] = r.count > 0 ? Json(r.median) : Json();
  json["queries"] = score.queries;
  json["positives"] = score.positives;
  json["loops"] = score.loops;
  json["loops_left_out"] = score.loops_left_out;
  json["threshold_m"] = options.threshold_m;
  json["min_gap_keyframes"] = options.against.empty() ? Json(options.min_gap_keyframes) : Json();
  return document(json);
}

std::string trajectory_json(const std::vector<SessionTrajectory>& sessions,
                            const evaluate::Alignment& alignment) {
  Json json;
  json["alignment"] = {
      {"of", "central session to its ground truth, rotation and translation"},
      {"from", alignment.used_orientations ? "positions and orientations" : "positions"}};
  Json& all = json["sessions"] = Json::object();
  for (const SessionTrajectory& session : sessions) {
    Json& entry = all[session.name] = {{"status", session.status}, {"poses", session.poses}};
    if (!session.error) {
      entry["paired"] = 0;
      entry["ate_m"] = nullptr;
      entry["rotation_deg"] = nullptr;
      entry["tilt_deg"] = nullptr;
      continue;
    }
    entry["paired"] = session.error->translation_m.count;
    entry["ate_m"] = error_figures(session.error->translation_m);
    entry["rotation_deg"] = error_figures(session.error->rotation_deg);
    entry["tilt_deg"] = error_figures(session.error->tilt_deg);
  }
  return document(json);
}

std::string map_json(const EvaluateMapOptions& options, const std::vector<SessionPair>& pairs,
                     const evaluate::MapEntropy& entropy, std::size_t points) {
  Json json;
  Json& all = json["pairs"] = Json::array();
  for (const SessionPair& pair : pairs) {
    const evaluate::CloudAgreement& a = pair.agreement;
    all.push_back({{"first", pair.first},
                   {"second", pair.second},
                   {"AC_rmse_m", number(a.ac_rmse_m)},
                   {"AC_mean_m", number(a.ac_mean_m)},
                   {"CD_L2_m", number(a.cd_l2_m)},
                   {"CD_L2_squared_m2", number(a.cd_l2_squared_m2)},
                   {"inliers_first", a.inliers_first},
                   {"inliers_second", a.inliers_second}});
  }
  json["MME"] = number(entropy.mean);
  json["MME_points"] = entropy.points;
  json["MME_skipped"] = entropy.skipped;
  json["points"] = points;
  json["tau_m"] = options.tau_m;
  json["MME_radius_m"] = options.mme_radius_m;
  json["MME_min_neighbours"] = options.mme_min_neighbours;
  json["formulas"] = {
      {"AC_rmse_m", "root mean square of nearest distances below tau, both directions pooled"},
      {"AC_mean_m", "mean of the same distances"},
      {"CD_L2_m", "mean nearest distance below tau there plus back"},
      {"CD_L2_squared_m2", "mean squared nearest distance below tau there plus back"},
      {"MME", "mean of 1/2 ln |2 pi e Sigma|, Sigma in square metres"}};
  return document(json);
}

std::vector<SummarySession> read_summary(const std::filesystem::path& map) {
  const std::filesystem::path file = map / "summary.json";
  std::ifstream in(file);
  if (!in) {
    throw std::runtime_error(file.string() + ": no such file; `unimapper merge` writes it");
  }
  try {
    const Json json = Json::parse(in);
    std::vector<SummarySession> sessions;
    for (const Json& entry : json.at("sessions")) {
      SummarySession& session = sessions.emplace_back();
      session.name = entry.at("name").get<std::string>();
      session.status = entry.at("status").get<std::string>();
      if (!entry.contains("origin")) continue;
      const auto origin = entry.at("origin").get<std::array<double, 3>>();
      session.origin = Eigen::Vector3d(origin[0], origin[1], origin[2]);
    }
    return sessions;
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

std::vector<ReportedChange> read_changes(const std::filesystem::path& map) {
  const std::filesystem::path file = map / "changes.json";
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<ReportedChange> changes;
  try {
    const Json json = Json::parse(in);
    for (const Json& object : json.at("objects")) {
      changes.push_back(
          {object.at("session").get<std::string>(), object.at("free_in").get<std::string>(),
           change_of(object.at("kind").get<std::string>()), box_of(object.at("box"))});
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  return changes;
}

std::string changes_json(const std::vector<evaluate::FoundChange>& found,
                         const std::vector<evaluate::TrueChange>& truth,
                         const evaluate::ChangeScore& score) {
  using evaluate::FoundClass;
  Json json = {{"precision", percent(score.precision())},
               {"recall", percent(score.recall())},
               {"found", found.size()},
               {"right", score.count(FoundClass::kRight)},
               {"replaced", score.count(FoundClass::kReplaced)},
               {"parts", score.count(FoundClass::kPart)},
               {"stood", score.count(FoundClass::kStood)},
               {"vehicles_changed", score.changed},
               {"vehicles_found", score.changed - score.missed.size()},
               {"wrong", Json::array()},
               {"missed", Json::array()}};
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (score.found[i] != FoundClass::kWrong) continue;
    json["wrong"].push_back(
        {{"kind", kind_name(found[i].change)}, {"box", describe(found[i].box)}});
  }
  for (const std::size_t i : score.missed) {
    json["missed"].push_back({{"kind", kind_name(truth[i].change)},
                              {"label", truth[i].label},
                              {"box", describe(truth[i].box)}});
  }
  return document(json);
}

}  // namespace unimapper::apps
