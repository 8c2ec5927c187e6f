// Answer where the library was built without ports/keys.
#include <cerrno>

#include "ports/delivery/authentication.hpp"
#include "ports/delivery/refusal.hpp"

namespace unimapper::delivery {

std::unique_ptr<Authentication> read_authentication(const std::filesystem::path& key_file) {
  throw Refusal(ENOTSUP,
                key_file.string() + ": this library was built without keys (UNIMAPPER_BUILD_KEYS)");
}

}  // namespace unimapper::delivery
