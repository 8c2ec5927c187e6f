// Form of LCM addresses.
#pragma once

#include <string>

namespace unimapper::lcm_port {

/// What is wrong with the form of an LCM address, with one that would do; empty if nothing is.
/// liblcm ignores unknown options and values that are no numbers, reads numbers with a leading zero
/// as octal, and takes a missing port for 0. Its client of `tcpq` aborts where no server is. All
/// these are faults.
[[nodiscard]] std::string address_fault(const std::string& url);

}  // namespace unimapper::lcm_port
