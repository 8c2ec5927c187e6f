#include "src/apps/view/event_stream.hpp"

#include <utility>

namespace unimapper::apps {
namespace {

constexpr std::size_t kKept = 1000;

}  // namespace

void EventStream::publish(const std::string& event, const std::string& data) {
  {
    const std::lock_guard lock(mutex_);
    ++last_;
    kept_.push_back("id: " + std::to_string(last_) + "\nevent: " + event + "\ndata: " + data +
                    "\n\n");
    if (kept_.size() > kKept) kept_.pop_front();
  }
  changed_.notify_all();
}

std::string EventStream::after(std::uint64_t& seen, std::chrono::milliseconds most, bool& missed) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, most, [&] { return closed_ || last_ > seen; });
  const std::uint64_t first = last_ + 1 - kept_.size();
  missed = seen + 1 < first && last_ > seen;
  std::string text;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (first + i > seen) text += kept_[i];
  }
  seen = last_;
  return text;
}

std::uint64_t EventStream::latest() {
  const std::lock_guard lock(mutex_);
  return last_;
}

void EventStream::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool EventStream::is_closed() {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace unimapper::apps
