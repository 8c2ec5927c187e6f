// Options of `unimapper view`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace unimapper::apps {

struct ViewOptions {
  std::filesystem::path map;            ///< a store, or a map that was written
  std::string http = "127.0.0.1:8080";  ///< HOST:PORT
  std::int64_t epoch = 0;               ///< of a store; 0: the latest
  bool read_only = false;               ///< nobody may change the store
};

/// Serves the page of a map until SIGINT or SIGTERM; says on standard output where. Throws
/// std::runtime_error with a sentence for the user.
void run_view(const ViewOptions& options);

}  // namespace unimapper::apps
