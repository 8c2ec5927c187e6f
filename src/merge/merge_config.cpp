// Validation of the merger's parameters.
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {
namespace {

constexpr Error invalid(const char* message) noexcept {
  return {ErrorCode::kInvalidConfig, message};
}

}  // namespace

Error MergeConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  if (acceptance.min_strong_loops > acceptance.min_loops) {
    return invalid("acceptance.min_strong_loops must not exceed acceptance.min_loops");
  }
  return {};
}

}  // namespace unimapper::merge
