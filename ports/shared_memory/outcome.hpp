// Outcome of a call on shared memory.
#pragma once

namespace unimapper::shared_memory {

/// Whether a call did what it was asked to. `message` is a constant sentence that says what was
/// refused and what to do about it, "" if all is well; `error_number` is errno's value.
struct [[nodiscard]] Outcome {
  bool ok = true;            ///< it was done
  int error_number = 0;      ///< errno, 0 if it was done or errno tells nothing
  const char* message = "";  ///< what was refused, and the remedy
};

}  // namespace unimapper::shared_memory
