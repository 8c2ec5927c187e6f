// Command-line tool: bytes and milliseconds of keyframes on the wire.
//   bench_wire RUN/keyframes.lcmlog...
#include <zlib.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "ports/lcm/keyframe_codec.hpp"
#include "ports/lcm/quantise.hpp"
#include "ports/lcm/receiver.hpp"
#include "ports/lcm/sending.hpp"
#include "unimapper/core/quantile.hpp"

namespace {

using namespace unimapper;
using Payload = std::vector<std::uint8_t>;

constexpr int kRepeats = 5;

/// The fastest of a few runs, which other load affects least.
double best_ms(const std::function<void()>& work) {
  double best = 1e300;
  for (int i = 0; i < kRepeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    best = std::min(best, took.count());
  }
  return best;
}

Payload deflated(const Payload& payload, int level) {
  uLongf bytes = compressBound(payload.size());
  Payload out(bytes);
  compress2(out.data(), &bytes, payload.data(), payload.size(), level);
  out.resize(bytes);
  return out;
}

/// One figure per keyframe and its name.
struct Column {
  const char* name;
  std::vector<double> values;
};

void measure(const KeyframeRecord& record, std::vector<Column>& columns) {
  const Payload payload = wire::encode_keyframe(record);
  // The pipeline's order of cells differs from the wire's.
  KeyframeRecord unsorted = record;
  std::stable_sort(unsorted.static_cells.begin(), unsorted.static_cells.end(),
                   [](const FineCell& a, const FineCell& b) { return a.points < b.points; });
  Payload fast;
  Payload small;
  std::size_t next = 0;
  const auto add = [&](const char* name, double value) {
    if (columns.size() == next) columns.push_back({name, {}});
    columns[next++].values.push_back(value);
  };
  const auto cells = static_cast<double>(record.static_cells.size() + record.dynamic_cells.size());
  const auto bytes = static_cast<double>(payload.size());
  add("cells", cells);
  add("keypoints", static_cast<double>(record.keypoints.size()));
  add("planes", static_cast<double>(record.planes.size()));
  add("bytes", bytes);
  add("bytes per cell", bytes / cells);
  add("bytes with 7 per cell", bytes + 7.0 * cells - 4.0 * cells);
  add("quantise ms", best_ms([&] {
        KeyframeRecord copy = unsorted;
        wire::quantise(copy);
      }));
  add("encode ms", best_ms([&] { (void)wire::encode_keyframe(record); }));
  add("cut into messages ms", best_ms([&] {
        wire::EncodedKeyframe keyframe{record.session, record.sequence, 0, payload};
        (void)wire::cut_into_messages(keyframe, wire::kLargestDatagramBytes);
      }));
  add("decode ms", best_ms([&] { (void)wire::decode_keyframe(payload); }));
  add("zlib level 1 ms", best_ms([&] { fast = deflated(payload, 1); }));
  add("zlib level 1 bytes", static_cast<double>(fast.size()));
  add("zlib level 6 ms", best_ms([&] { small = deflated(payload, 6); }));
  add("zlib level 6 bytes", static_cast<double>(small.size()));
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> logs;
  CLI::App app{"What keyframes cost on the wire: bytes and milliseconds."};
  app.add_option("LOG", logs, "RUN/keyframes.lcmlog")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<Column> columns;
    for (const std::string& log : logs) {
      for (const SessionData& session : wire::read_event_log(log).sessions) {
        for (const KeyframeRecord& record : session.keyframes) measure(record, columns);
      }
    }
    if (columns.empty()) {
      std::fprintf(stderr, "no keyframes in these logs\n");
      return 2;
    }
    std::printf("%zu keyframes\n%-24s %12s %12s\n", columns[0].values.size(), "", "median", "max");
    for (Column& column : columns) {
      const std::span values(column.values);
      std::printf("%-24s %12.3f %12.3f\n", column.name, median(values), quantile(values, 1.0));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
