// Program that ends with 1 if publishing into a queue allocates.
#include <chrono>
#include <cstdio>
#include <thread>

#include "ports/delivery/unimapper_delivery.h"
#include "ports/linux/allocation_counter.hpp"
#include "tests/wire/stream.hpp"

using namespace unimapper;

int main() {
  um_delivery_options options;
  if (um_delivery_options_init(&options) != 0) return 2;
  options.name = "robot7";
  options.url = "memq://";
  options.queue_keyframes = 16;
  options.finish_timeout_ms = 0;
  um_delivery* delivery = nullptr;
  if (um_delivery_create(&options, &delivery, nullptr, 0) != 0) return 2;
  SessionId id;
  if (um_delivery_session(delivery, &id.robot, &id.boot.high, &id.boot.low) != 0) return 2;
  const auto bytes = wire::encode_keyframe(wire::wire_test::keyframe_of(id, 0));
  int published = 0;
  {
    const linux_port::AllocationGuard guard;
    for (int i = 0; i < 10; ++i) {
      published += um_delivery_publish(delivery, bytes.data(), bytes.size(), i) == 0 ? 1 : 0;
    }
  }
  const auto allocations = static_cast<unsigned long>(linux_port::AllocationGuard::count());
  um_delivery_destroy(delivery);
  std::printf("%d keyframes, %lu allocations\n", published, allocations);
  return published == 10 && allocations == 0 ? 0 : 1;
}
