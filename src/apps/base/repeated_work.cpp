#include "src/apps/base/repeated_work.hpp"

#include <chrono>
#include <exception>
#include <utility>

namespace unimapper::apps {

namespace {

constexpr std::chrono::milliseconds kRepeatPause{200};

}  // namespace

RepeatedWork::RepeatedWork(RepeatedWorkOptions options) : options_(std::move(options)) {
  thread_ = std::thread([this] { run(); });
}

RepeatedWork::~RepeatedWork() { finish(); }

void RepeatedWork::finish() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void RepeatedWork::run() {
  for (;;) {
    const bool has_more = advance();
    std::unique_lock lock(mutex_);
    const auto pause = has_more ? std::chrono::milliseconds::zero() : kRepeatPause;
    if (wake_.wait_for(lock, pause, [this] { return stopping_; })) return;
  }
}

/// True if more can be done at once.
bool RepeatedWork::advance() {
  std::string trouble;
  bool has_more = false;
  try {
    has_more = options_.advance();
  } catch (const std::exception& error) {
    trouble = error.what();
  }
  if (trouble != trouble_) {
    options_.report(trouble.empty()
                        ? options_.works
                        : "warning: " + options_.fails + ", and it is tried again: " + trouble);
  }
  trouble_ = std::move(trouble);
  return has_more;
}

}  // namespace unimapper::apps
