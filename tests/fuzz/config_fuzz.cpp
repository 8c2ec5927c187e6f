// Fuzz target of configurations: whatever the JSON says, what is accepted is valid and comes back
// from what is written.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/onboard/config.hpp"

namespace {

using namespace unimapper;

template <typename Config>
void parse(std::string_view text) {
  Config config;
  try {
    parse_config(text, "file", config);
  } catch (const std::runtime_error& error) {
    // The message names the file.
    if (std::string_view(error.what()).substr(0, 4) != "file") std::abort();
    return;
  }
  if (config.validate().code != ErrorCode::kOk) std::abort();
  const std::string written = dump_config(config);
  Config again;
  parse_config(written, "written", again);
  if (dump_config(again) != written) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  data[0] % 2 == 0 ? parse<PipelineConfig>(text) : parse<merge::MergeConfig>(text);
  return 0;
}
