// Cost of sharing on the pipeline's thread: time of a keyframe with its health, and of its labels.
//   share_cost RECORDING SENSOR
//
// Replays a recording and prints the keyframes, their median megabytes, and p50, p99 and the
// longest milliseconds of sharing a keyframe and its health, and of the labels of its scans.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "unimapper/core/quantile.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace {

using namespace unimapper;
using shared_memory::PipelineShare;

/// A pipeline's topics with or without labels, removed at the end.
class Share {
 public:
  Share(const std::string& name, const PipelineConfig& config, bool labels) {
    shared_memory::PipelineShareOptions options;
    options.labels = labels;
    const shared_memory::Outcome opened = share_.open(name, config, {1, 1}, options);
    if (!opened.ok) throw std::runtime_error(opened.message);
  }
  ~Share() { share_.remove(); }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;
  PipelineShare* operator->() { return &share_; }

 private:
  PipelineShare share_;
};

/// Milliseconds of one call of `work`.
template <typename Work>
double milliseconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

void print(const char* what, std::vector<double>& values) {
  const std::span span(values);
  std::printf("%s %.2f %.2f %.2f\n", what, median(span), quantile(span, 0.99), quantile(span, 1.0));
}

void run(const std::string& folder, const std::string& sensor) {
  const SensorModel* model = find_sensor(sensor);
  if (model == nullptr) throw std::runtime_error(sensor + ": no such sensor");
  const auto recording = datasets::open_dataset(folder);
  const PipelineConfig config = preset(model->kind);
  OwnedPipeline pipeline(config);
  if (!pipeline) throw std::runtime_error(pipeline.error().message);
  const std::string name = "cost-" + std::to_string(getpid());
  Share keyframes(name, config, false);
  Share both(name + "-labels", config, true);
  std::vector<double> megabytes;
  std::vector<double> keyframe_ms;
  std::vector<double> labels_ms;
  datasets::Scan scan;
  for (std::size_t i = 0; i < recording->scan_count(); ++i) {
    recording->read_scan(i, scan);
    const ScanResult result =
        pipeline->add_scan(scan.view(), recording->pose(i), recording->stamp_ns(i));
    if (!result.keyframe_ready) continue;
    const KeyframeView& keyframe = pipeline->keyframe();
    megabytes.push_back(static_cast<double>(keyframe.static_cells.size_bytes() +
                                            keyframe.dynamic_cells.size_bytes()) *
                        1e-6);
    const double alone = milliseconds([&] { keyframes->after_scan(*pipeline, result); });
    const double all = milliseconds([&] { both->after_scan(*pipeline, result); });
    keyframe_ms.push_back(alone);
    labels_ms.push_back(std::max(all - alone, 0.0));
  }
  if (keyframe_ms.empty()) throw std::runtime_error(folder + ": no keyframe");
  std::printf("keyframes %zu %.1f\n", keyframe_ms.size(), median(std::span(megabytes)));
  print("keyframe", keyframe_ms);
  print("labels", labels_ms);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: share_cost RECORDING SENSOR\n");
    return 2;
  }
  try {
    run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
