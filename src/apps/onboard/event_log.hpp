// Event log file with a writer thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stop_token>
#include <thread>

#include "unimapper/core/event_ring.hpp"
#include "unimapper/core/owned.hpp"

namespace unimapper::apps {

/// A ring for `PipelineConfig::events` and the thread that empties it into a file, one line an
/// event. The pipeline never waits for the file; events that do not fit are counted there.
class EventLog {
 public:
  /// Creates the file. With `says`, what contradicts the poses is printed on stderr at once, too.
  /// Throws std::runtime_error.
  EventLog(const std::filesystem::path& file, bool says);

  [[nodiscard]] EventRing* ring() noexcept { return ring_; }

  /// Writes what is left and closes the file. The pipeline must not run any more. Throws
  /// std::runtime_error if not everything could be written.
  void finish();

 private:
  void write_events();

  std::filesystem::path file_;
  bool says_;
  std::ofstream out_;
  MemoryBlock memory_;
  EventRing* ring_ = nullptr;
  std::uint32_t lost_ = 0;
  bool failed_ = false;  ///< lines may be missing
  std::jthread writer_;  // last: it ends before what it uses
};

}  // namespace unimapper::apps
