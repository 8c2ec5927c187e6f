#include "page_use.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <new>
#include <sstream>
#include <string>

namespace unimapper::bench {
namespace {

std::size_t page_bytes() { return static_cast<std::size_t>(sysconf(_SC_PAGESIZE)); }

std::size_t in_pages(std::size_t bytes) {
  return (bytes + page_bytes() - 1) / page_bytes() * page_bytes();
}

std::string hexadecimal(const void* address) {
  std::ostringstream text;
  text << std::hex << reinterpret_cast<std::uintptr_t>(address);
  return text.str();
}

}  // namespace

OwnMapping::OwnMapping(std::size_t bytes)
    : bytes_(bytes), mapped_(in_pages(bytes) + 2 * page_bytes()) {
  void* const mapping =
      mmap(nullptr, mapped_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (mapping == MAP_FAILED) throw std::bad_alloc();
  mapping_ = static_cast<std::byte*>(mapping);
  block_ = mapping_ + page_bytes();
  if (mprotect(block_, in_pages(bytes), PROT_READ | PROT_WRITE) != 0) {
    munmap(mapping_, mapped_);
    throw std::bad_alloc();
  }
}

OwnMapping::~OwnMapping() { munmap(mapping_, mapped_); }

void OwnMapping::start_counting() {
  std::ofstream file("/proc/self/clear_refs");
  file << '1' << std::flush;  // all pages: not touched since
  counting_ = file.good();
}

std::optional<std::size_t> OwnMapping::touched_bytes() const {
  if (!counting_) return std::nullopt;
  std::ifstream smaps("/proc/self/smaps");
  const std::string start = hexadecimal(block_) + '-';
  bool here = false;
  for (std::string line; std::getline(smaps, line);) {
    if (line.starts_with(start)) here = true;
    if (!here || !line.starts_with("Referenced:")) continue;
    std::istringstream words(line.substr(line.find(':') + 1));
    std::size_t kilobytes = 0;
    if (words >> kilobytes) return kilobytes * 1024;
  }
  return std::nullopt;
}

}  // namespace unimapper::bench
