#include "background_load.hpp"

#include <pthread.h>
#include <sched.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

namespace unimapper::bench {
namespace {

void pin_to(int processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processor, &set);
  if (pthread_setaffinity_np(pthread_self(), sizeof set, &set) != 0) {
    throw std::runtime_error("this thread cannot be kept on one processor");
  }
}

void stream(const std::atomic<bool>& stop) {
  std::vector<std::uint64_t> words(std::size_t{4} << 20U);  // 32 MB: more than most caches
  while (!stop.load(std::memory_order_relaxed)) {
    for (std::uint64_t& word : words) word = word * 3 + 1;
  }
}

}  // namespace

BackgroundLoad::BackgroundLoad(bool loaded) {
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  int first = -1;
  int last = -1;
  for (int i = 0; i < CPU_SETSIZE; ++i) {
    if (!CPU_ISSET(i, &allowed)) continue;
    if (first < 0) first = i;
    last = i;
  }
  if (!loaded) return;
  if (first == last) throw std::runtime_error("--load needs a second processor");
  busy_ = std::thread([this, first] {
    pin_to(first);
    stream(stop_);
  });
  pin_to(last);
}

BackgroundLoad::~BackgroundLoad() {
  stop_ = true;
  if (busy_.joinable()) busy_.join();
}

}  // namespace unimapper::bench
