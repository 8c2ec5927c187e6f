// Configuration structs as JSON, by their parameter tables.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "unimapper/core/parameter_table.hpp"

namespace unimapper {

/// Overwrites the parameters of `config` that the JSON object `text` names: {"removal": {"window":
/// 5}}. What is not named keeps its value. Throws std::runtime_error, whose message starts with
/// `source` (a file name) and names the key, for what is no parameter, of the wrong type or out of
/// its range. Values that do not fit each other are left to the struct's `validate()`.
void read_parameters(std::string_view text, const std::string& source,
                     std::span<const Parameter> table, void* config);

/// All parameters as JSON, nested like the structs; `read_parameters` reads it back bit by bit.
[[nodiscard]] std::string write_parameters(std::span<const Parameter> table, const void* config);

/// All parameters as Markdown: a heading and a table per struct. The defaults are those of
/// `config`.
[[nodiscard]] std::string parameters_as_markdown(std::span<const Parameter> table,
                                                 const void* config);

/// `read_parameters` for a struct, then its `validate()`; throws for what it refuses.
template <typename Config>
void parse_config(std::string_view text, const std::string& source, Config& config) {
  read_parameters(text, source, kParameters<Config>, &config);
  const Error error = config.validate();
  if (error.code != ErrorCode::kOk) throw std::runtime_error(source + ": " + error.message);
}

template <typename Config>
[[nodiscard]] std::string dump_config(const Config& config) {
  return write_parameters(kParameters<Config>, &config);
}

}  // namespace unimapper
