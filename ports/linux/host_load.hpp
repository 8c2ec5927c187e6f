// Load of a host while times are taken on it.
#pragma once

#include <filesystem>
#include <string>

namespace unimapper::linux_port {

/// Processors of a host and what is running on them. Times mean little without.
struct HostLoad {
  std::string processor;  ///< its model, as the system names it; empty: unknown
  unsigned cores = 0;     ///< that this process may use
  /// Processes with the name of this one's program, this one included: robots and bases on one
  /// machine. 0: unknown.
  unsigned same_program = 0;
  double load_average =
      -1.0;  ///< runnable and waiting threads, mean of a minute; negative: unknown
};

/// As it is now. Reads /proc: a few milliseconds where there are hundreds of processes.
[[nodiscard]] HostLoad host_load();

/// What a file holds; empty if it cannot be read, also where its process ends meanwhile.
[[nodiscard]] std::string text_of_file(const std::filesystem::path& path);

/// The model in the text of /proc/cpuinfo: "model name" on a PC, "Model" on ARM boards; empty if
/// there is none.
[[nodiscard]] std::string processor_model(const std::string& cpuinfo);

/// The mean of the last minute in the text of /proc/loadavg; negative if it is none.
[[nodiscard]] double load_of_a_minute(const std::string& loadavg);

}  // namespace unimapper::linux_port
