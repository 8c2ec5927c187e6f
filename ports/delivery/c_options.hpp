// Options of the C interface: what may be asked for.
#pragma once

#include <string>

#include "ports/delivery/delivery.hpp"
#include "ports/delivery/unimapper_delivery.h"

namespace unimapper::delivery {

/// Throws Refusal for what no delivery can have.
void check(const um_delivery_options& options);

/// The options for C++, without guard and session.
[[nodiscard]] DeliveryOptions to_cpp(const um_delivery_options& options);

/// "" for null.
[[nodiscard]] inline std::string text_of(const char* text) { return text != nullptr ? text : ""; }

}  // namespace unimapper::delivery
