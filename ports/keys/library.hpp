// Start of libsodium.
#pragma once

namespace unimapper::keys {

/// To be called before anything else of libsodium; cheap from the second time on, thread safe.
/// Throws std::runtime_error where the library cannot start.
void require_library();

}  // namespace unimapper::keys
