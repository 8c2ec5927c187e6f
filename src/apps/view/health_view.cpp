#include "src/apps/view/health_view.hpp"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Figures by name, each as long as the time is: what a message has not is null.
class Columns {
 public:
  explicit Columns(std::size_t rows) : rows_(rows) {}

  void put(const char* group, const std::string& name, std::size_t row, double value) {
    Json& column = columns_[group][name];
    if (column.is_null()) column = Json(std::vector<Json>(rows_, Json(nullptr)));
    column[row] = value;
  }
  /// A group of columns; an empty object without any.
  [[nodiscard]] Json take(const char* group) {
    return columns_.contains(group) ? columns_[group] : Json::object();
  }

 private:
  std::size_t rows_;
  Json columns_ = Json::object();
};

constexpr double kMillisecondsPerNanosecond = 1e-6;

/// Half of the shortest round trip bounds what the offset of a clock is uncertain by.
double latency_of_clock(const store::HealthDetail& clock) {
  return clock.figures[0] * kMillisecondsPerNanosecond;
}

void put_detail(const store::HealthDetail& detail, std::size_t row, Columns& columns) {
  const std::vector<double>& figures = detail.figures;
  if (detail.kind == "stage" && figures.size() >= 3) {
    columns.put("stage_ms", detail.name + " p50", row, figures[0]);
    columns.put("stage_ms", detail.name + " p99", row, figures[1]);
  } else if (detail.kind == "container" && figures.size() >= 2 && figures[1] > 0.0) {
    columns.put("fill", detail.name, row, figures[0] / figures[1]);
  } else if (detail.kind == "drop" && !figures.empty()) {
    columns.put("dropped", detail.name, row, figures[0]);
  } else if (detail.kind == "clock") {
    columns.put("clock", "offset", row, clock_offset_ms(detail));
    if (!figures.empty()) columns.put("clock", "latency", row, latency_of_clock(detail));
  } else if (detail.kind == "stored" && !figures.empty()) {
    columns.put("stored", "keyframes", row, figures[0]);
  }
  if (detail.kind == "container" && detail.name == wire::kSpoolContainer && !figures.empty()) {
    columns.put("spool", "bytes", row, figures[0]);
  }
}

}  // namespace

double clock_offset_ms(const store::HealthDetail& clock) {
  return std::strtod(clock.name.c_str(), nullptr) * kMillisecondsPerNanosecond;
}

std::optional<double> link_latency_ms(const store::HealthRow& health) {
  for (const store::HealthDetail& detail : health.details) {
    if (detail.kind == "clock" && !detail.figures.empty()) return latency_of_clock(detail);
  }
  return std::nullopt;
}

Json describe_health(const std::vector<store::HealthRow>& history, std::int64_t row) {
  std::vector<const store::HealthRow*> own;
  for (const store::HealthRow& health : history) {
    if (health.session == row) own.push_back(&health);
  }
  if (own.empty()) return nullptr;
  Json json;
  for (const char* list : {"time_s", "deadline_misses", "keyframes", "bytes_sent"}) {
    json[list] = Json::array();
  }
  Columns columns(own.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    json["time_s"].push_back(own[i]->received_s);
    json["deadline_misses"].push_back(own[i]->deadline_misses);
    json["keyframes"].push_back(own[i]->keyframes);
    json["bytes_sent"].push_back(own[i]->bytes_sent);
    for (const store::HealthDetail& detail : own[i]->details) put_detail(detail, i, columns);
  }
  for (const char* group : {"stage_ms", "fill", "dropped"}) json[group] = columns.take(group);
  const Json clock = columns.take("clock");
  json["clock_offset_ms"] = clock.contains("offset") ? clock["offset"] : Json::array();
  json["latency_ms"] = clock.contains("latency") ? clock["latency"] : Json::array();
  const Json spool = columns.take("spool");
  json["spool_bytes"] = spool.contains("bytes") ? spool["bytes"] : Json::array();
  const Json stored = columns.take("stored");
  json["acknowledged"] = stored.contains("keyframes") ? stored["keyframes"] : Json::array();
  json["missing"] = Json::array();
  for (std::size_t i = 0; i < json["acknowledged"].size(); ++i) {
    const Json& then = json["acknowledged"][i];
    json["missing"].push_back(
        then.is_null()
            ? Json(nullptr)
            : Json(std::max(0.0, static_cast<double>(own[i]->keyframes) - then.get<double>())));
  }
  return json;
}

}  // namespace unimapper::apps
