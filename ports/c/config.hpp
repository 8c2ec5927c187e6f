// Conversion between um_config and PipelineConfig.
#pragma once

#include <cstddef>
#include <cstdint>

#include "ports/c/unimapper.h"
#include "unimapper/core/parameter_table.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::c {

/// Whether a configuration is accepted, and if not, what is wrong in words.
struct ConfigStatus {
  um_status status = UM_OK;
  const char* message = "";
};

/// Hands a sentence to a caller who wants one (`message` may be null). Returns the status.
inline um_status say(um_status status, const char* sentence, const char** message) noexcept {
  if (message != nullptr) *message = sentence;
  return status;
}

/// Fills in a caller's struct.
[[nodiscard]] um_status init_config(const PipelineConfig& from, um_config* out) noexcept;

/// The recommended parameters for a sensor and a computer (enums um_sensor and um_computer);
/// otherwise says which of them does not exist.
[[nodiscard]] um_status preset_config(std::uint32_t sensor, std::uint32_t computer,
                                      PipelineConfig& out) noexcept;

/// Reads a caller's configuration, null included, and validates it.
[[nodiscard]] ConfigStatus read_config(const um_config* config, PipelineConfig& out) noexcept;

/// Sets one parameter. A refusal leaves the configuration as it is; its sentence lies in the
/// configuration.
[[nodiscard]] ConfigStatus set_config(um_config* config, const char* name,
                                      const char* value) noexcept;

/// The text of one parameter's value.
[[nodiscard]] um_status get_config(const um_config* config, const char* name,
                                   ParameterMessage& value) noexcept;

}  // namespace unimapper::c
