// Counters in the text format of Prometheus.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <mutex>
#include <string>
#include <utility>

namespace unimapper::apps {

/// Metrics one after the other, each with its help and its type.
class PrometheusText {
 public:
  /// What only grows from the start on.
  template <typename Value>
  void count(const char* name, const char* help, Value value) {
    add("counter", name, help, value);
  }
  /// What may fall.
  template <typename Value>
  void gauge(const char* name, const char* help, Value value) {
    add("gauge", name, help, value);
  }
  /// How long something took: `times` has bounds, counts with one more for what is beyond them, and
  /// a total, as `store::Latencies`.
  template <typename Times>
  void times(const char* name, const char* help, const Times& times) {
    head("histogram", name, help);
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < times.kBounds.size(); ++i) {
      below += times.counts[i];
      line(name, fmt::format("_bucket{{le=\"{}\"}}", seconds(times.kBounds[i])), below);
    }
    below += times.counts.back();
    line(name, "_bucket{le=\"+Inf\"}", below);
    line(name, "_sum", seconds(times.total));
    line(name, "_count", below);
  }
  /// All of them.
  [[nodiscard]] std::string take() { return std::move(text_); }

  /// Prometheus' unit of time.
  static double seconds(std::chrono::nanoseconds time) {
    return std::chrono::duration<double>(time).count();
  }

 private:
  template <typename Value>
  void add(const char* type, const char* name, const char* help, Value value) {
    head(type, name, help);
    line(name, "", value);
  }
  void head(const char* type, const char* name, const char* help) {
    text_ += fmt::format("# HELP unimapper_{0} {1}\n# TYPE unimapper_{0} {2}\n", name, help, type);
  }
  template <typename Value>
  void line(const char* name, const std::string& end, Value value) {
    text_ += fmt::format("unimapper_{}{} {}\n", name, end, value);
  }

  std::string text_;
};

/// The latest text, from thread to thread.
class LatestMetrics {
 public:
  /// Takes its place.
  void set(std::string text) {
    const std::lock_guard<std::mutex> lock(guard_);
    text_ = std::move(text);
  }
  /// A copy.
  [[nodiscard]] std::string get() const {
    const std::lock_guard<std::mutex> lock(guard_);
    return text_;
  }

 private:
  mutable std::mutex guard_;
  std::string text_;
};

}  // namespace unimapper::apps
