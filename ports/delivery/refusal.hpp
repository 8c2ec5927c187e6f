// Refusal of a call from C.
#pragma once

#include <stdexcept>
#include <string>

namespace unimapper::delivery {

/// Why a call is refused, with the value of errno that the caller gets.
class Refusal : public std::runtime_error {
 public:
  Refusal(int error_number, const std::string& text)
      : std::runtime_error(text), number(error_number) {}
  int number;  ///< of errno
};

}  // namespace unimapper::delivery
