#include "event_log.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>

#include "ports/events/event_text.hpp"
#include "src/apps/print.hpp"

namespace unimapper::apps {
namespace {

// Enough for the events of several keyframes with every kind of fault.
constexpr std::uint32_t kCapacity = 1024;

}  // namespace

EventLog::EventLog(const std::filesystem::path& file, bool says)
    : file_(file), says_(says), out_(file), memory_(EventRing::required_bytes(kCapacity)) {
  if (!out_) throw std::runtime_error("cannot create " + file.string());
  const auto created = EventRing::create(kCapacity, memory_.span());
  if (!created) throw std::runtime_error(created.error().message);
  ring_ = created.value();
  writer_ = std::jthread([this](const std::stop_token& stop) {
    std::mutex mutex;
    std::condition_variable_any wakeup;
    std::unique_lock lock(mutex);
    while (!stop.stop_requested()) {
      write_events();
      // Never notified: a sleep that ends early when the run does.
      wakeup.wait_for(lock, stop, std::chrono::milliseconds(100), [] { return false; });
    }
  });
}

void EventLog::finish() {
  writer_.request_stop();
  writer_.join();
  write_events();
  out_.close();
  if (!out_ || failed_) throw std::runtime_error("cannot write " + file_.string());
}

void EventLog::write_events() {
  lost_ = events::drain(*ring_, lost_, [this](const std::string& line, const EventRecord& record) {
    out_ << line << '\n';
    if (says_ && events::is_contradiction(record)) {
      print_to(stderr, "onboard: warning: {}\n", line);
    }
  });
  if (out_.flush()) return;
  // Tried again with the next lines: a disk may have room later.
  failed_ = true;
  out_.clear();
}

}  // namespace unimapper::apps
