// Options and steps of `unimapper base`, and what `unimapper inspect` says of a store.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "ports/nats/server.hpp"

namespace unimapper::apps {

struct BaseOptions {
  std::filesystem::path store;  ///< folder of the store
  std::string listen;           ///< LCM URL; empty: no robots are heard
  std::string from;             ///< NATS servers of the sites' stream; empty: none
  std::string uplink;           ///< NATS servers that the store is sent to; empty: none
  std::string site;             ///< name of this site in the stream
  bool uplinks_all = false;     ///< including what was sent before
  nats_port::Server nats;       ///< credentials for either
  std::string http;             ///< HOST:PORT of the page; empty: none
  std::filesystem::path keys;   ///< folder of robots' keys; empty: everybody is heard
  std::size_t sessions = 0;     ///< ends once so many have ended; 0: runs until it is told to stop
  bool localises = false;       ///< robots in the store's map, and tells them
  bool merges = false;          ///< what it stores, and tells robots where they are
  std::size_t localised_sessions = 4;  ///< at once
  /// Of merges and of localisation, for keyframes and clouds, MB; empty: the configuration's.
  std::optional<std::uint32_t> memory_mb;
  double max_gigabytes = 0.0;  ///< of the database; 0: as much as the disk holds
  double robot_gigabytes = 200.0;
  double robot_megabytes_per_second = 40.0;
  std::uint64_t robot_sessions = 1000;
  std::uint32_t robot_incomplete = 16;
};

/// Receives and stores until a signal or the expected number of sessions ends it. Throws
/// std::runtime_error with a sentence for the user.
void run_base(const BaseOptions& options);

/// Prints what a store holds; with `check`, reads all of it and says what is damaged. Throws
/// std::runtime_error if it is no store, or if something is damaged.
void inspect_store(const std::filesystem::path& store, bool json, bool check);

}  // namespace unimapper::apps
