#include "src/apps/evaluate/worst_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;
using evaluate::ObjectErrors;
using evaluate::Tally;

constexpr std::size_t kObjectsShown = 12;

std::string decimal(double value, const char* unit) {
  if (!std::isfinite(value)) return "–";
  return fmt::format("{:.1f}{}", value, unit);
}

/// "car 1200, pedestrian 30": a count of every group that has any.
template <typename Groups, typename Name, typename Count>
std::string list(const Groups& groups, Name name, Count count) {
  std::string text;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (count(groups[i]) == 0) continue;
    text += (text.empty() ? "" : ", ") + name(i) + " " + std::to_string(count(groups[i]));
  }
  return text.empty() ? "–" : text;
}

std::string class_of_index(std::size_t c) { return std::string(evaluate::class_name(c)); }

std::string by_class(const evaluate::DynamicScore& score, std::uint64_t (*count)(const Tally&)) {
  return list(score.by_class, class_of_index, count);
}

std::string by_range(const evaluate::DynamicScore& score, std::uint64_t (*count)(const Tally&)) {
  return list(
      score.by_range, [](std::size_t b) { return evaluate::range_bin_name(b) + " m:"; }, count);
}

std::uint64_t missed(const Tally& tally) { return tally.missed(); }
std::uint64_t lost(const Tally& tally) { return tally.lost(); }

std::string object_name(const ObjectErrors& errors) {
  std::string name(evaluate::class_name(evaluate::class_of(errors.label)));
  if (errors.label >> 16U != 0) name += " " + std::to_string(errors.label >> 16U);
  return name;
}

std::string object_row(const FrameObject& object) {
  const ObjectErrors& errors = object.errors;
  const bool is_dynamic = errors.tally.dynamic_points > 0;
  const std::uint64_t points = errors.tally.static_points + errors.tally.dynamic_points;
  return "| " + object_name(errors) + " | " + (is_dynamic ? "missed" : "lost") + " " +
         std::to_string(errors.tally.wrong()) + " of " + std::to_string(points) + " | " +
         decimal(static_cast<double>(errors.wrong_range_m), " m") + " | " +
         decimal(static_cast<double>(errors.wrong_center_sensor.x()), "") + ", " +
         decimal(static_cast<double>(errors.wrong_center_sensor.y()), "") + ", " +
         decimal(static_cast<double>(errors.wrong_center_sensor.z()), "") + " | " +
         decimal(object.moved_m, " m") + " |\n";
}

std::string frame_section(const WorstFrame& frame, std::size_t scans_between) {
  const Tally& total = frame.score.total;
  std::string text = "\n## Scan " + frame.name + "\n\n![as the sensor sees it](" +
                     frame.range_image + ")\n\n![from above](" + frame.top_view + ")\n\n";
  text += "* missed (dynamic, kept): " + std::to_string(total.missed()) + " of " +
          std::to_string(total.dynamic_points) + "; " + by_class(frame.score, missed) + "; " +
          by_range(frame.score, missed) + "\n";
  text += "* lost (static, removed): " + std::to_string(total.lost()) + " of " +
          std::to_string(total.static_points) + "; " + by_class(frame.score, lost) + "; " +
          by_range(frame.score, lost) + "\n\n";
  text += "| object | wrong | mean range | x, y, z in the sensor's frame | moved in " +
          std::to_string(scans_between) + " scans |\n|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < std::min(kObjectsShown, frame.objects.size()); ++i) {
    text += object_row(frame.objects[i]);
  }
  return text;
}

Json wrong_counts(const Tally& tally) {
  return {{"false_static", tally.missed()}, {"false_dynamic", tally.lost()}};
}

Json object_json(const FrameObject& object) {
  const ObjectErrors& errors = object.errors;
  const Eigen::Vector3f& p = errors.wrong_center_sensor;
  Json json = {{"class", evaluate::class_name(evaluate::class_of(errors.label))},
               {"instance", errors.label >> 16U},
               {"points", errors.tally.static_points + errors.tally.dynamic_points}};
  json.update(wrong_counts(errors.tally));
  json["range_m"] = errors.wrong_range_m;
  json["position_sensor_m"] = {p.x(), p.y(), p.z()};
  json["moved_m"] = std::isfinite(object.moved_m) ? Json(object.moved_m) : Json();
  return json;
}

Json frame_json(const WorstFrame& frame) {
  Json json = {{"scan", frame.name}, {"number", frame.scan}};
  json.update(wrong_counts(frame.score.total));
  json["static_points"] = frame.score.total.static_points;
  json["dynamic_points"] = frame.score.total.dynamic_points;
  Json& classes = json["by_class"] = Json::object();
  for (std::size_t c = 0; c < evaluate::kClassCount; ++c) {
    if (frame.score.by_class[c].wrong() == 0) continue;
    classes[class_of_index(c)] = wrong_counts(frame.score.by_class[c]);
  }
  Json& ranges = json["by_range_m"] = Json::object();
  for (std::size_t b = 0; b < evaluate::kRangeBinCount; ++b) {
    ranges[evaluate::range_bin_name(b)] = wrong_counts(frame.score.by_range[b]);
  }
  Json& objects = json["objects"] = Json::array();
  for (const FrameObject& object : frame.objects) objects.push_back(object_json(object));
  json["range_image"] = frame.range_image;
  json["top_view"] = frame.top_view;
  return json;
}

}  // namespace

std::string worst_markdown(const std::vector<WorstFrame>& frames, std::size_t scans_between) {
  std::string text =
      "# Worst frames\n\nRanked by the number of wrongly labelled points, at least ten scans "
      "apart.\nGrey: static, kept. Blue: dynamic, removed. Red: dynamic and missed. Orange: static "
      "and lost.\nRings at 10, 20, 30 and 50 m.\n\n| scan | missed | lost | missed by class | lost "
      "by class |\n|---|---|---|---|---|\n";
  for (const WorstFrame& frame : frames) {
    text += "| " + frame.name + " | " + std::to_string(frame.score.total.missed()) + " | " +
            std::to_string(frame.score.total.lost()) + " | " + by_class(frame.score, missed) +
            " | " + by_class(frame.score, lost) + " |\n";
  }
  for (const WorstFrame& frame : frames) text += frame_section(frame, scans_between);
  return text;
}

std::string worst_json(const std::vector<WorstFrame>& frames, std::size_t scans_between) {
  Json json = {{"ranked_by", "wrongly labelled points"}, {"scans_between_moves", scans_between}};
  Json& all = json["frames"] = Json::array();
  for (const WorstFrame& frame : frames) all.push_back(frame_json(frame));
  return json.dump(2) + "\n";
}

}  // namespace unimapper::apps
