// The onboard pipeline's parameters as a JSON file.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {

/// Overwrites the members of `config` that `text` names. Nesting and names are those of
/// `PipelineConfig`; what is not named keeps its value. Throws std::runtime_error naming `file`
/// and the key for anything that is no parameter, has the wrong type or does not validate.
void parse_config(std::string_view text, const std::filesystem::path& file, PipelineConfig& config);

/// `parse_config` on the content of `file`.
void read_config(const std::filesystem::path& file, PipelineConfig& config);

/// All parameters as JSON that `parse_config` reads back to the same bits.
[[nodiscard]] std::string dump_config(const PipelineConfig& config);

}  // namespace unimapper::apps
