#include "ports/linux/host_load.hpp"

#include <sched.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace unimapper::linux_port {
namespace {

unsigned usable_cores() {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (sched_getaffinity(0, sizeof cores, &cores) != 0) return 0;
  return static_cast<unsigned>(CPU_COUNT(&cores));
}

bool is_number(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

unsigned processes_called(const std::string& name) {
  if (name.empty()) return 0;
  unsigned count = 0;
  std::error_code error;
  std::filesystem::directory_iterator entry("/proc", error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (!is_number(entry->path().filename().string())) continue;
    if (text_of_file(entry->path() / "comm") == name) ++count;
  }
  return count;
}

}  // namespace

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string text;
  // An iterator over the buffer would throw where the process ends meanwhile.
  std::getline(in, text, '\0');
  return text;
}

std::string processor_model(const std::string& cpuinfo) {
  std::istringstream lines(cpuinfo);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("model name") && !line.starts_with("Model")) continue;
    const std::size_t colon = line.find(':');
    const std::size_t begin =
        line.find_first_not_of(" \t", colon == std::string::npos ? colon : colon + 1);
    if (begin != std::string::npos) return line.substr(begin);
  }
  return {};
}

double load_of_a_minute(const std::string& loadavg) {
  std::istringstream in(loadavg);
  in.imbue(std::locale::classic());
  double load = -1.0;
  if (!(in >> load) || !std::isfinite(load)) return -1.0;
  return load;
}

HostLoad host_load() {
  HostLoad load;
  load.processor = processor_model(text_of_file("/proc/cpuinfo"));
  load.cores = usable_cores();
  load.same_program = processes_called(text_of_file("/proc/self/comm"));
  load.load_average = load_of_a_minute(text_of_file("/proc/loadavg"));
  return load;
}

}  // namespace unimapper::linux_port
