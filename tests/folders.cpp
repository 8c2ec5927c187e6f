#include "folders.hpp"

namespace unimapper::testing {

const char* source_folder() noexcept { return UNIMAPPER_SOURCE_DIR; }
const char* recordings_folder() noexcept { return UNIMAPPER_RECORDINGS_DIR; }

}  // namespace unimapper::testing
