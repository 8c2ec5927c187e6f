// Health of a pipeline in C as the message that tells a base of it.
#pragma once

#include "unimapper/wire/messages.hpp"

struct um_health;

namespace unimapper::delivery {

/// All but session and bytes sent.
[[nodiscard]] wire::HealthMessage to_message(const um_health& health);

}  // namespace unimapper::delivery
