// Form of LCM addresses.
#pragma once

#include <string>

namespace unimapper::lcm_port {

/// What is wrong with the form of an LCM address, with one that would do; empty if nothing is. Only
/// `udpm` is looked into: it needs a multicast group and, if any, a port.
[[nodiscard]] std::string address_fault(const std::string& url);

}  // namespace unimapper::lcm_port
