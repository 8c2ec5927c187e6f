// Fuzz target of configurations: whatever the JSON says, what is accepted is valid and comes back
// from what is written.
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/fuzz/fuzz.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/onboard/config.hpp"

namespace {

using namespace unimapper;
using fuzz::require;

template <typename Config>
void parse(std::string_view text) {
  Config config;
  try {
    parse_config(text, "file", config);
  } catch (const std::runtime_error& error) {
    // The message names the file.
    require(std::string_view(error.what()).starts_with("file"));
    return;
  }
  require(config.validate().ok());
  const std::string written = dump_config(config);
  Config again;
  parse_config(written, "written", again);
  require(dump_config(again) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text = fuzz::text_of(data + 1, size - 1);
  data[0] % 2 == 0 ? parse<PipelineConfig>(text) : parse<merge::MergeConfig>(text);
  return 0;
}
