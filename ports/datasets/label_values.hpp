// Labels of points as SemanticKITTI numbers them, as far as this project writes them.
#pragma once

#include <cstdint>

namespace unimapper::datasets {

inline constexpr std::uint32_t kLabelIgnored = 0;    ///< "unlabeled": scored neither way
inline constexpr std::uint32_t kLabelStatic = 9;     ///< static, of no further class
inline constexpr std::uint32_t kLabelDynamic = 251;  ///< dynamic, of no further class

}  // namespace unimapper::datasets
