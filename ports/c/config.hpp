// um_config and PipelineConfig, one into the other.
#pragma once

#include <cstddef>
#include <cstdint>

#include "ports/c/unimapper.h"
#include "unimapper/onboard/config.hpp"

namespace unimapper::c {

/// Whether a configuration is accepted, and if not, what is wrong in words.
struct ConfigVerdict {
  um_status status = UM_OK;
  const char* message = "";
};

/// Whether a program may know um_config with this size: at least the members before the first
/// parameter, whole members only, and nothing this library does not know.
[[nodiscard]] bool is_config_size(std::size_t struct_size) noexcept;

/// The complete recommended configuration for a sensor and a computer (enums um_sensor and
/// um_computer); otherwise says which of them does not exist.
[[nodiscard]] um_status preset_config(std::uint32_t sensor, std::uint32_t computer,
                                      um_config& out) noexcept;

/// Reads a caller's configuration of any known version, null included, and validates it. `full` is
/// the same with what the caller's version lacks.
[[nodiscard]] ConfigVerdict read_config(const um_config* config, PipelineConfig& out,
                                        um_config& full) noexcept;

}  // namespace unimapper::c
