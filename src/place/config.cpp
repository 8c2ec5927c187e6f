// Validation of the parameters of description and loop search.
#include "unimapper/place/config.hpp"

namespace unimapper {
namespace {

constexpr Error invalid(const char* message) noexcept {
  return {ErrorCode::kInvalidConfig, message};
}

}  // namespace

Error DescriptorConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  if (max_candidates < max_keypoints) {
    return invalid("descriptor.max_candidates must be no fewer than descriptor.max_keypoints");
  }
  return {};
}

Error LoopSearchConfig::validate() const noexcept {
  const Error error = check_ranges(*this);
  if (error.code != ErrorCode::kOk) return error;
  if (triangles.max_side_m < triangles.min_side_m) {
    return invalid(
        "loop_search.triangles.max_side_m must be no shorter than "
        "loop_search.triangles.min_side_m");
  }
  if (max_verified > max_candidates) {
    return invalid("loop_search.max_verified must not exceed loop_search.max_candidates");
  }
  // Offsets into the tables are 32 bits wide.
  if (std::uint64_t{max_places} * triangles.max_triangles > (1ULL << 30U)) {
    return invalid(
        "loop_search.max_places times loop_search.triangles.max_triangles must not exceed 2^30");
  }
  return {};
}

}  // namespace unimapper
