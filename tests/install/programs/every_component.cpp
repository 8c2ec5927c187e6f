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

namespace {

/// None is there: what is wanted is the sentence that says so.
template <typename Call>
void print_refusal(const char* component, const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    std::printf("%s: %s\n", component, error.what());
  }
}

}  // namespace

int main() {
  print_refusal("lcm", [] { (void)lcm_port::read_event_log("/nonexistent"); });
  print_refusal("datasets", [] { (void)datasets::open_dataset("/nonexistent"); });
  print_refusal("store", [] { (void)store::StoreReader("/nonexistent"); });
  print_refusal("spool", [] { (void)spool::Spool("/dev/null/spool"); });
  print_refusal("delivery", [] {
    delivery::DeliveryOptions options;
    options.spool = "/dev/null/spool";
    (void)delivery::Delivery({{}, "robot", "generic"}, options);
  });
  shared_memory::Reader reader;
  std::printf("shared memory: %s\n", reader.open("nonexistent", "keyframe").message);
  std::printf("events: %s\n", events::to_text({}).c_str());
  std::printf("evaluate: %zu errors\n", evaluate::statistics({1.0, 2.0}).count);
  return 0;
}
