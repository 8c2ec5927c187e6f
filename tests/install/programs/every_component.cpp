// One call of each port and of the evaluation, to see that they link from an installed package.
#include <cstdio>
#include <exception>

#include "ports/datasets/dataset.hpp"
#include "ports/delivery/delivery.hpp"
#include "ports/events/event_text.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/shared_memory/reader.hpp"
#include "ports/spool/spool.hpp"
#include "ports/store/store_reader.hpp"
#include "unimapper/evaluate/trajectory.hpp"

using namespace unimapper;

int main() {
  // None is there: what is wanted is the sentence that says so.
  try {
    (void)lcm_port::read_event_log("/nonexistent");
  } catch (const std::exception& error) {
    std::printf("lcm: %s\n", error.what());
  }
  try {
    (void)datasets::open_dataset("/nonexistent");
  } catch (const std::exception& error) {
    std::printf("datasets: %s\n", error.what());
  }
  try {
    (void)store::StoreReader("/nonexistent");
  } catch (const std::exception& error) {
    std::printf("store: %s\n", error.what());
  }
  try {
    const spool::Spool spool("/dev/null/spool");
  } catch (const std::exception& error) {
    std::printf("spool: %s\n", error.what());
  }
  try {
    delivery::DeliveryOptions options;
    options.spool = "/dev/null/spool";
    const delivery::Delivery delivery({{}, "robot", "generic"}, options);
  } catch (const std::exception& error) {
    std::printf("delivery: %s\n", error.what());
  }
  shared_memory::Reader reader;
  std::printf("shared memory: %s\n", reader.open("nonexistent", "keyframe").message);
  std::printf("events: %s\n", events::to_text({}).c_str());
  std::printf("evaluate: %zu errors\n", evaluate::statistics({1.0, 2.0}).count);
  return 0;
}
