// Budget and health: a time limit for calls, and what was dropped or refused.
#include <cstdio>
#include <ctime>
#include <unimapper/onboard/events.hpp>
#include <unimapper/onboard/owned_pipeline.hpp>

using namespace unimapper;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

int main() {
  alignas(64) static std::byte memory[EventRing::required_bytes(64)];
  EventRing* const events = EventRing::create(64, memory).value();  // read by any one thread
  PipelineConfig config = preset(SensorKind::kVlp16);
  config.clock_ns = monotonic_ns;
  config.budget_us = 50'000;  // calls that take longer are counted
  config.events = events;
  OwnedPipeline pipeline(config);
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  float scan[300][3];
  for (int i = 0; i < 300; ++i) scan[i][0] = 10, scan[i][1] = 0.1F * i - 15, scan[i][2] = 0;
  for (std::int64_t k = 0; k < 10; ++k)
    (void)pipeline->add_scan(PointView::xyz(scan, k == 3 ? 0 : 300, 12), Pose{}, k + 1);
  (void)pipeline->flush();

  const KeyframeStatistics& health = *pipeline->keyframe().statistics;
  std::printf("%.0f us, %s\n", static_cast<double>(health.microseconds(Stage::kTotal)),
              health.deadline_missed ? "late" : "in time");
  for (std::size_t i = 0; i < kCapacities; ++i)
    std::printf("%s: %lu of %lu\n", capacity_name(static_cast<Capacity>(i)).data(),
                static_cast<unsigned long>(health.capacity[i].used),
                static_cast<unsigned long>(health.capacity[i].capacity));
  for (EventRecord record; events->pop(record);)
    std::printf("event %u at %ld ns\n", record.id, static_cast<long>(record.stamp_ns));
}
