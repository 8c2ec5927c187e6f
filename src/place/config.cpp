#include "unimapper/place/config.hpp"

namespace unimapper {
Error DescriptorConfig::validate() const noexcept { return {}; }
Error LoopSearchConfig::validate() const noexcept { return {}; }
}  // namespace unimapper
