#include "ports/store/health_history.hpp"

#include <cstdio>
#include <string>

#include "ports/store/session_key.hpp"

namespace unimapper::store {

namespace {

/// One line for each list member; names are the robot's own words.
std::string details_of(const wire::HealthMessage& health) {
  std::string text;
  const auto line = [&text](const char* kind, const std::string& name, const std::string& figures) {
    std::string safe = name;
    for (char& c : safe) c = c == '\n' || c == '\t' ? ' ' : c;
    text += std::string(kind) + "\t" + safe + "\t" + figures + "\n";
  };
  for (const auto& stage : health.stages) {
    char figures[96];
    std::snprintf(figures, sizeof figures, "%.3f\t%.3f\t%.3f", static_cast<double>(stage.p50_ms),
                  static_cast<double>(stage.p99_ms), static_cast<double>(stage.max_ms));
    line("stage", stage.name, figures);
  }
  for (const auto& drop : health.drops) line("drop", drop.cause, std::to_string(drop.count));
  for (const auto& container : health.containers) {
    line("container", container.name,
         std::to_string(container.used) + "\t" + std::to_string(container.capacity));
  }
  if (health.clock) {
    line("clock", std::to_string(health.clock->base_minus_robot_ns),
         std::to_string(health.clock->uncertainty_ns) + "\t" + std::to_string(health.clock->steps));
  }
  return text;
}

}  // namespace

HealthHistory::HealthHistory(const Database& database)
    : insert_(database,
              "INSERT OR REPLACE INTO health (session, slot, received_s, scans, keyframes, "
              "points_in, bytes_sent, deadline_misses, details) "
              "SELECT id, ?, ?, ?, ?, ?, ?, ?, ? || "
              // How far the store was then, in the same transaction.
              "'stored' || char(9) || 'keyframes' || char(9) || keyframes || char(10) "
              "FROM sessions WHERE identity = ?") {}

void HealthHistory::keep(const wire::HealthMessage& health, std::int64_t now_s) {
  insert_
      .bind(now_s / kHealthPeriodSeconds % kHealthRows, now_s, to_integer(health.scans),
            to_integer(health.keyframes), to_integer(health.points_in),
            to_integer(health.bytes_sent), to_integer(health.deadline_misses), details_of(health),
            to_key(health.session))
      .run();
}

}  // namespace unimapper::store
