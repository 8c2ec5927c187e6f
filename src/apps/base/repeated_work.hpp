// Thread of a base that does a piece of work again and again.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace unimapper::apps {

/// What is repeated, and what is said of it.
struct RepeatedWorkOptions {
  std::function<bool()> advance;  ///< true: there is more to do at once; its exceptions are told
  std::string works;              ///< said where it works again after it failed
  std::string fails;              ///< said with the reason where it fails
  std::function<void(const std::string&)> report;  ///< told in words, from the thread
};

/// Works five times a second, and without a pause while there is more to do. Whatever fails is told
/// in words, once, and tried again.
class RepeatedWork {
 public:
  /// Starts the thread.
  explicit RepeatedWork(RepeatedWorkOptions options);
  /// As `finish`.
  ~RepeatedWork();
  RepeatedWork(const RepeatedWork&) = delete;
  RepeatedWork& operator=(const RepeatedWork&) = delete;

  /// Waits for the piece of work that is being done, and ends the thread.
  void finish();

 private:
  void run();
  bool advance();

  RepeatedWorkOptions options_;
  std::string trouble_;  ///< the thread's own: as it was told last
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace unimapper::apps
