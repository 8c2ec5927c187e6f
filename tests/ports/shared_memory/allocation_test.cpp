// Program that ends with 1 if publishing or taking a message allocates.
#include <cstdio>

#include "ports/linux/allocation_counter.hpp"
#include "tests/ports/shared_memory/share.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;

int main() {
  const test::TestShare share;
  Writer writer;
  Reader reader;
  if (!writer.open(share.name(), "topic").ok || !reader.open(share.name(), "topic").ok) return 2;
  int messages = 0;
  {
    const linux_port::AllocationGuard guard;
    for (int i = 0; i < 100; ++i) {
      const std::span<std::byte> memory = writer.loan();
      memory.front() = std::byte{1};
      if (writer.publish(memory.size(), i) == 0) return 2;
      Sample sample;
      if (reader.wait(1'000'000) && reader.take(sample) == Taken::kMessage) ++messages;
    }
  }
  const auto allocations = static_cast<unsigned long>(linux_port::AllocationGuard::count());
  std::printf("%d messages, %lu allocations\n", messages, allocations);
  return messages == 100 && allocations == 0 ? 0 : 1;
}
