// Conversion between um_config and PipelineConfig.
#include "ports/c/config.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace unimapper::c {
namespace {

/// What um_config's hidden part holds.
struct Hidden {
  std::uint64_t magic;
  PipelineConfig config;
  char message[ParameterMessage::kCapacity];  ///< of the last refused um_config_set
};
static_assert(sizeof(Hidden) <= sizeof(um_config::hidden));
static_assert(alignof(Hidden) <= alignof(std::uint64_t));
static_assert(UM_MAX_WORKERS == Executor::kMaxWorkers);
static_assert(std::is_same_v<um_part, Executor::Part> &&
              std::is_same_v<decltype(um_executor::run), decltype(Executor::run)>);
static_assert(std::is_trivially_copyable_v<Hidden> && std::is_standard_layout_v<Hidden>);

// "umconfig"
constexpr std::uint64_t kConfigMagic = 0x756d636f6e666967ULL;

constexpr const char* kNotFilledIn =
    "the configuration was not filled in by um_config_init, or its hidden part was overwritten";

/// Calls `f(C member, C++ member)` for the parameters that are members of um_config.
template <typename CConfig, typename Config, typename Function>
void visit_members(CConfig& c, Config& p, Function f) noexcept {
  f(c.keyframe_scans, p.keyframe.scans);
  f(c.keyframe_range_min_m, p.keyframe.range_min_m);
  f(c.keyframe_range_max_m, p.keyframe.range_max_m);
  f(c.keyframe_max_points_per_scan, p.keyframe.max_points_per_scan);
  f(c.voxel_max_cells, p.voxel.max_cells);
  f(c.loop_search_max_places, p.loop_search.max_places);
  f(c.loop_search_accept_confidence, p.loop_search.accept_confidence);
  f(c.budget_us, p.budget_us);
}

Hidden hidden_of(const um_config& config) noexcept {
  Hidden hidden;
  std::memcpy(&hidden, config.hidden, sizeof hidden);
  return hidden;
}

/// Writes all parameters into the hidden part and the members.
void store(const PipelineConfig& from, um_config& to) noexcept {
  const Hidden hidden{kConfigMagic, from, {}};
  std::memcpy(to.hidden, &hidden, sizeof hidden);
  visit_members(to, from, [](auto& c, const auto& p) { c = p; });
}

/// The parameters of a caller's configuration: its members, and the hidden part for all others.
ConfigStatus load(const um_config* config, PipelineConfig& out) noexcept {
  if (config == nullptr) return {UM_NULL_ARGUMENT, um_status_text(UM_NULL_ARGUMENT)};
  // Compared before it is taken for a configuration: garbage is no valid bool.
  if (config->hidden[0] != kConfigMagic) return {UM_INVALID_CONFIG, kNotFilledIn};
  out = hidden_of(*config).config;
  visit_members(*config, out, [](const auto& c, auto& p) { p = c; });
  out.clock_ns = config->clock_ns;
  out.executor = {config->executor.run, config->executor.context, config->executor.workers};
  return {};
}

/// Keeps a sentence in the configuration; the pointer is valid as long as that is.
const char* keep(const ParameterMessage& message, um_config& config) noexcept {
  char* const kept = reinterpret_cast<char*>(config.hidden) + offsetof(Hidden, message);
  std::memcpy(kept, message.c_str(), message.view().size() + 1);
  return kept;
}

}  // namespace

um_status init_config(const PipelineConfig& from, um_config* out) noexcept {
  if (out == nullptr) return UM_NULL_ARGUMENT;
  std::memset(static_cast<void*>(out), 0, sizeof *out);
  store(from, *out);
  out->executor.workers = 1;
  return UM_OK;
}

um_status preset_config(std::uint32_t sensor, std::uint32_t computer,
                        PipelineConfig& out) noexcept {
  if (sensor >= sensor_models().size()) return UM_UNKNOWN_SENSOR;
  if (computer > UM_COMPUTER_ARMV7_WITH_64_MB) return UM_UNKNOWN_COMPUTER;
  out = preset(static_cast<SensorKind>(sensor), static_cast<Computer>(computer));
  return UM_OK;
}

ConfigStatus read_config(const um_config* config, PipelineConfig& out) noexcept {
  const ConfigStatus loaded = load(config, out);
  if (loaded.status != UM_OK) return loaded;
  constexpr std::uint32_t kMostEvents = 1U << 20U;
  const std::uint32_t events = config->event_capacity;
  if (events > kMostEvents || (events & (events - 1)) != 0) {
    return {UM_INVALID_CONFIG, "config.event_capacity must be 0 or a power of two up to 2^20"};
  }
  const Error error = out.validate();
  if (error.code != ErrorCode::kOk) return {UM_INVALID_CONFIG, error.message};
  return {};
}

ConfigStatus set_config(um_config* config, const char* name, const char* value) noexcept {
  PipelineConfig changed;
  const ConfigStatus loaded = load(config, changed);
  if (loaded.status != UM_OK) return loaded;
  if (name == nullptr || value == nullptr) {
    return {UM_NULL_ARGUMENT, um_status_text(UM_NULL_ARGUMENT)};
  }
  const Parameter* const parameter = find_parameter(kParameters<PipelineConfig>, name);
  if (parameter == nullptr) {
    return {UM_UNKNOWN_PARAMETER,
            keep(unknown_parameter(kParameters<PipelineConfig>, name), *config)};
  }
  ParameterMessage message;
  if (!set_parameter(*parameter, value, &changed, message)) {
    return {UM_INVALID_CONFIG, keep(message, *config)};
  }
  // The caller's are the ones that count.
  changed.clock_ns = nullptr;
  changed.executor = {};
  store(changed, *config);
  return {};
}

um_status get_config(const um_config* config, const char* name, ParameterMessage& value) noexcept {
  PipelineConfig loaded;
  const um_status status = load(config, loaded).status;
  if (status != UM_OK) return status;
  if (name == nullptr) return UM_NULL_ARGUMENT;
  const Parameter* const parameter = find_parameter(kParameters<PipelineConfig>, name);
  if (parameter == nullptr) return UM_UNKNOWN_PARAMETER;
  value = text_of(*parameter, &loaded);
  return UM_OK;
}

}  // namespace unimapper::c
