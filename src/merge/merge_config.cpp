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
  if (registration.fine_correspondence_m > RegistrationConfig::kCoarseCorrespondenceM) {
    return invalid(
        "registration.fine_correspondence_m must not exceed 2.5 m, that of the first stage");
  }
  if (acceptance.min_strong_loops > acceptance.min_loops) {
    return invalid("acceptance.min_strong_loops must not exceed acceptance.min_loops");
  }
  if (refinement.component_static_share > refinement.component_dynamic_share) {
    return invalid("refinement.component_static_share must not exceed component_dynamic_share");
  }
  return {};
}

}  // namespace unimapper::merge
