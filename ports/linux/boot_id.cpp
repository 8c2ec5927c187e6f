#include "ports/linux/boot_id.hpp"

#include <sys/random.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace unimapper::linux_port {

BootId random_boot() {
  // Requests of up to 256 bytes are never cut short.
  std::uint64_t halves[2] = {};
  while (getrandom(halves, sizeof halves, 0) != sizeof halves) {
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  return {halves[0], halves[1]};
}

}  // namespace unimapper::linux_port
