#include "ports/store/process_io.hpp"

#include <fstream>
#include <string>

namespace unimapper::store {

std::optional<std::uint64_t> bytes_written_to_disk() {
  std::ifstream file("/proc/self/io");
  std::string name;
  std::uint64_t value = 0;
  while (file >> name >> value) {
    if (name == "write_bytes:") return value;
  }
  return std::nullopt;
}

}  // namespace unimapper::store
