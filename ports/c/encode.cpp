// Keyframes as bytes, free-space images and earlier places for C.
#include <cstddef>
#include <cstdint>
#include <span>

#include "ports/c/handle.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

using namespace unimapper;
using namespace unimapper::c;

// Keypoints and planes are read where they lie (convert.cpp compares the layouts).
static_assert(UM_MAX_SCANS == KeyframeConfig::kMaxScans);

namespace {

um_status insert(um_pipeline* pipeline, const um_place* place, const KeyframeUp& up) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  const bool complete = place != nullptr &&
                        (place->keypoints != nullptr || place->keypoint_count == 0) &&
                        (place->planes != nullptr || place->plane_count == 0);
  if (!complete) return refuse(*pipeline, UM_NULL_ARGUMENT);
  if (place->session == 0) return refuse(*pipeline, UM_INVALID_INDEX);
  const Pose pose = from_c(place->T_odometry_keyframe);
  if (!pose.is_rigid()) return refuse(*pipeline, UM_INVALID_POSE);
  const PlaceView view{{reinterpret_cast<const Keypoint*>(place->keypoints), place->keypoint_count},
                       {reinterpret_cast<const PlanePatch*>(place->planes), place->plane_count},
                       up};
  pipeline->core->places().insert(view, KeyframeId{place->session, place->keyframe}, pose);
  return tell(*pipeline, {});
}

}  // namespace

extern "C" {

size_t um_encode_scratch_bytes(const um_pipeline* pipeline) {
  if (!is_pipeline(pipeline)) return 0;
  return wire::KeyframeEncoder::required_bytes(pipeline->config.voxel.max_cells);
}

um_status um_keyframe_encode(um_pipeline* pipeline, const um_session* session, void* scratch,
                             size_t scratch_bytes, void* buffer, size_t capacity,
                             um_encoded* encoded) {
  if (encoded != nullptr) *encoded = {};
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (session == nullptr || scratch == nullptr || encoded == nullptr ||
      (buffer == nullptr && capacity > 0)) {
    return refuse(*pipeline, UM_NULL_ARGUMENT);
  }
  if (!pipeline->keyframe_finished) return refuse(*pipeline, UM_NO_KEYFRAME);
  auto encoder = wire::KeyframeEncoder::create(pipeline->config.voxel.max_cells,
                                               {static_cast<std::byte*>(scratch), scratch_bytes});
  if (!encoder.ok()) return tell(*pipeline, encoder.error());
  const wire::EncodeResult result =
      encoder->encode(pipeline->core->finished_keyframe(),
                      {session->robot, {session->boot_high, session->boot_low}},
                      {static_cast<std::uint8_t*>(buffer), capacity});
  *encoded = {result.bytes, result.image_bytes, result.left_out};
  return tell(*pipeline, result.error);
}

um_status um_images_get(um_pipeline* pipeline, um_images* images) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (images == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  if (!pipeline->keyframe_ready) return refuse(*pipeline, UM_NO_KEYFRAME);
  const KeyframeView& view = pipeline->core->keyframe();
  const ImageProjection projection(view.image_shape);
  *images = {};
  images->count = static_cast<std::uint32_t>(view.images.size());
  images->columns = static_cast<std::uint32_t>(projection.columns());
  images->rows = static_cast<std::uint32_t>(projection.rows());
  images->horizontal_fov_deg = view.image_shape.horizontal_fov_deg;
  images->azimuth_resolution_deg = view.image_shape.azimuth_resolution_deg;
  images->elevation_min_deg = view.image_shape.elevation_min_deg;
  images->elevation_max_deg = view.image_shape.elevation_max_deg;
  images->elevation_resolution_deg = view.image_shape.elevation_resolution_deg;
  images->full_weight_range_m = view.image_full_weight_range_m;
  for (std::size_t i = 0; i < view.images.size(); ++i) {
    images->scans[i] = view.images[i].scan;
    images->pixels[i] = view.images[i].pixels.data();
  }
  return tell(*pipeline, {});
}

um_status um_place_insert(um_pipeline* pipeline, const um_place* place) {
  return insert(pipeline, place, {});
}

um_status um_place_insert_level(um_pipeline* pipeline, const um_place* place,
                                const float up_covariance[3]) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (up_covariance == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  return insert(pipeline, place, {true, up_covariance[0], up_covariance[1], up_covariance[2]});
}

}  // extern "C"
