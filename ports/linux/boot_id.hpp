// Random numbers of a robot's starts.
#pragma once

#include "unimapper/core/ids.hpp"

namespace unimapper::linux_port {

/// A boot id from the kernel's random numbers: no other start of any robot has it. Blocks only
/// before the kernel has gathered entropy, early after power-on. Throws std::system_error.
[[nodiscard]] BootId random_boot();

}  // namespace unimapper::linux_port
