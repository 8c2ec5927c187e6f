#include "ports/keys/library.hpp"

#include <sodium.h>

#include <stdexcept>

namespace unimapper::keys {

void require_library() {
  static const bool started = sodium_init() >= 0;
  if (!started) throw std::runtime_error("libsodium cannot start");
}

}  // namespace unimapper::keys
