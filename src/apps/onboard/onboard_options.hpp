// Options of `unimapper onboard`.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::apps {

struct OnboardOptions {
  std::filesystem::path dataset;
  std::filesystem::path out;
  datasets::OpenOptions input;        ///< its `sensor` empty: as the recording says
  std::filesystem::path sensor_file;  ///< data sheet of one's own; empty: none
  std::filesystem::path config;       ///< empty: the preset alone
  std::string preset = "default";
  std::string surroundings = "auto";
  std::string publish;                            ///< LCM URL, empty: not published
  std::uint32_t datagram_bytes = 60000;           ///< as in `lcm_port::PublisherOptions`
  double bytes_per_second = 20e6;                 ///< as in `lcm_port::PublisherOptions`
  double min_bytes_per_second = 4000.0;           ///< as in `lcm_port::PublisherOptions`
  std::uint64_t unacknowledged_bytes = 64000000;  ///< as in `lcm_port::PublisherOptions`
  std::filesystem::path spool;                    ///< folder, empty: none
  std::uint64_t spool_bytes = 2000000000;         ///< as in `spool::SpoolOptions`
  std::filesystem::path key;                      ///< the robot's key file; empty: none
  std::string share;                              ///< name in shared memory, empty: not shared
  std::string share_doorbell;  ///< LCM URL that `share` is announced on; empty: not
  std::uint32_t workers = 1;   ///< of the executor, this thread among them
  bool realtime = false;
  bool intensity = false;  ///< of cells also where keyframes are sent
  bool deferred = false;   ///< as `PipelineConfig::deferred`
  bool force = false;      ///< map what looks surely wrong
  std::vector<std::filesystem::path> against;
  bool all_candidates = false;
  bool replaces = false;      ///< overwrite an earlier run
  bool final_labels = false;  ///< write the labels of evicted keyframes, too
  std::size_t scans = std::numeric_limits<std::size_t>::max();
};

/// Replays a recording through the onboard pipeline and writes the run folder. Throws
/// std::exception with a sentence for the user.
void run_onboard(const OnboardOptions& options);

/// The parameters that `run_onboard` would use, as a configuration file.
[[nodiscard]] std::string effective_config(const OnboardOptions& options);

}  // namespace unimapper::apps
