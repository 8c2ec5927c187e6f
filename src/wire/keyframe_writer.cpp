#include "keyframe_writer.hpp"

#include <algorithm>
#include <cmath>

#include "keyframe_layout.hpp"
#include "keyframe_limits.hpp"
#include "range_coder.hpp"
#include "span_writer.hpp"
#include "src/core/image_code.hpp"
#include "src/core/quantise.hpp"

namespace unimapper::wire {

namespace {

/// Farther from the odometry's origin than any Earth-fixed grid reaches: a forged pose.
constexpr double kMaxTranslationM = 1e8;

const char* pose_fault(const Pose& pose) noexcept {
  if (!pose.is_finite()) return "a pose is not finite";
  if (pose.translation.cwiseAbs().maxCoeff() > kMaxTranslationM) return "a pose is off the Earth";
  if (!pose.is_rigid()) return "a pose's rotation is not a rotation";
  return nullptr;
}

const char* up_fault(const KeyframeUp& up) noexcept {
  if (!up.known) return nullptr;
  // Comparisons with NaN are false. A standard deviation of 3 rad says nothing any more.
  const bool is_covariance = up.variance_x > 0.0F && up.variance_y > 0.0F &&
                             up.variance_x < 10.0F && up.variance_y < 10.0F &&
                             up.covariance_xy * up.covariance_xy < up.variance_x * up.variance_y;
  return is_covariance ? nullptr : "the covariance of up is none";
}

const char* scan_fault(std::span<const KeyframeScan> scans) noexcept {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (const char* fault = pose_fault(scans[i].T_odometry_sensor)) return fault;
    if (i == 0) continue;
    if (scans[i].scan_index <= scans[i - 1].scan_index) return "scan indices do not ascend";
    if (scans[i].stamp_ns < scans[i - 1].stamp_ns) return "scan stamps run backwards";
  }
  return nullptr;
}

const char* image_fault(const KeyframeContent& keyframe) noexcept {
  if (keyframe.images.empty()) return nullptr;
  if (const char* fault = image_head_fault(keyframe.images.size(), keyframe.image_shape,
                                           keyframe.image_full_weight_range_m)) {
    return fault;
  }
  const std::size_t pixels = ImageProjection(keyframe.image_shape).pixels();
  for (const FreeSpaceImage& image : keyframe.images) {
    if (image.scan >= keyframe.scans.size()) return "the scan of a free-space image is not there";
    if (image.pixels.size() != pixels) return "a free-space image has another shape";
  }
  return nullptr;
}

void put_pose(SpanWriter& out, const Pose& pose) noexcept {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.put(pose.rotation(row, column));
  }
  for (int axis = 0; axis < 3; ++axis) out.put(pose.translation[axis]);
}

void put_scan(SpanWriter& out, const KeyframeScan& scan) noexcept {
  out.put(scan.scan_index);
  out.put(scan.stamp_ns);
  put_pose(out, scan.T_odometry_sensor);
}

void put_normal(SpanWriter& out, OctahedralNormal normal) noexcept {
  out.put(normal.u);
  out.put(normal.v);
}

/// Writes the keypoints that lie within the grid and returns how many.
std::uint32_t put_keypoints(SpanWriter& out, std::span<const Keypoint> keypoints) noexcept {
  std::uint32_t written = 0;
  for (const Keypoint& keypoint : keypoints) {
    const auto steps = to_millimetres(keypoint.position);
    const auto normal = octahedral(keypoint.normal);
    if (!steps || !normal) continue;
    for (int axis = 0; axis < 3; ++axis) out.put((*steps)[axis]);
    put_normal(out, *normal);
    out.put(keypoint.occupancy);
    out.put(keypoint.strength);
    ++written;
  }
  return written;
}

/// Writes the planes that lie within the grid and returns how many.
std::uint32_t put_planes(SpanWriter& out, std::span<const PlanePatch> planes) noexcept {
  std::uint32_t written = 0;
  for (const PlanePatch& plane : planes) {
    const auto steps = to_centimetres(plane.center);
    const auto normal = octahedral(plane.normal);
    if (!steps || !normal) continue;
    for (int axis = 0; axis < 3; ++axis) out.put(static_cast<std::int16_t>((*steps)[axis]));
    put_normal(out, *normal);
    ++written;
  }
  return written;
}

/// Sorted cells, handed to the coder one block after the other.
class KeyWalk {
 public:
  explicit KeyWalk(std::span<const CellKey> keys) noexcept : keys_(keys) {}

  bool next_block(RangeEncoder& coder, CellCode& code) noexcept {
    if (at_ == keys_.size()) return false;
    const std::uint32_t block = block_of(keys_[at_]);
    code.code_gap(coder, block - next_block_);
    next_block_ = block + 1;
    for (std::size_t i = at_; i < keys_.size() && block_of(keys_[i]) == block; ++i) {
      code.mark(keys_[i]);
    }
    return true;
  }
  bool code_cell(RangeEncoder& coder, CellCode& code, int index) noexcept {
    bool more = true;
    while (more) {
      const CellKey key = keys_[at_++];
      code.code_detail(coder, index, key);
      more = at_ < keys_.size() && is_same_cell(key, keys_[at_]);
      code.code_more(coder, more);
    }
    return true;
  }

 private:
  std::span<const CellKey> keys_;
  std::size_t at_ = 0;
  std::uint32_t next_block_ = 0;
};

void put_cells(SpanWriter& out, std::span<const CellKey> keys, CellCode& code) noexcept {
  out.put(static_cast<std::uint32_t>(keys.size()));
  const std::size_t bytes_at = out.position();
  out.put(std::uint32_t{0});
  if (keys.empty()) return;
  RangeEncoder coder(out);
  KeyWalk walk(keys);
  code_cells(coder, code, walk);
  coder.finish();
  out.put_at(bytes_at, static_cast<std::uint32_t>(out.position() - bytes_at - 4));
}

/// Writes the intensities of sorted cells, if one is known; says whether.
bool put_intensities(SpanWriter& out, std::span<const CellKey> keys) noexcept {
  if (std::all_of(keys.begin(), keys.end(), [](CellKey key) { return intensity_of(key) == 0; })) {
    return false;
  }
  for (const CellKey key : keys) out.put(intensity_of(key));
  return true;
}

void put_up(SpanWriter& out, const KeyframeUp& up) noexcept {
  for (const float value : {up.variance_x, up.covariance_xy, up.variance_y}) {
    out.put(up.known ? value : 0.0F);
  }
}

void put_slip(SpanWriter& out, const SlipCovariance& slip) noexcept {
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) out.put(slip(row, column));
  }
}

void put_image_head(SpanWriter& out, std::size_t count, const KeyframeContent& keyframe) noexcept {
  out.put(static_cast<std::uint32_t>(count));
  if (count == 0) return;
  const RangeImageShape& shape = keyframe.image_shape;
  for (const float angle_deg :
       {shape.horizontal_fov_deg, shape.azimuth_resolution_deg, shape.elevation_min_deg,
        shape.elevation_max_deg, shape.elevation_resolution_deg}) {
    out.put(angle_deg);
  }
  out.put(keyframe.image_full_weight_range_m);
}

/// Range code of images, from their pixels or from bytes.
class ImageCoder {
 public:
  ImageCoder(SpanWriter& out, ImageBytes& bytes) noexcept : coder_(out), bytes_(bytes) {
    bytes_.reset();
  }

  std::uint32_t put(const FreeSpaceImage& image) noexcept {
    bytes_.start_image();
    count_ = 0;
    encode_image(image.pixels, {[](void* coder, std::uint8_t byte) noexcept {
                                  static_cast<ImageCoder*>(coder)->put(byte);
                                },
                                this});
    return count_;
  }
  std::uint32_t put(const CodedImage& image) noexcept {
    bytes_.start_image();
    for (const std::uint8_t byte : image.code) put(byte);
    return static_cast<std::uint32_t>(image.code.size());
  }
  void finish() noexcept { coder_.finish(); }

 private:
  void put(std::uint8_t byte) noexcept {
    bytes_.code(coder_, byte);
    ++count_;
  }

  RangeEncoder coder_;
  ImageBytes& bytes_;
  std::uint32_t count_ = 0;
};

template <typename Image>
std::size_t put_image_list(SpanWriter& out, std::span<const Image> images,
                           const KeyframeContent& keyframe, ImageBytes& bytes) noexcept {
  put_image_head(out, images.size(), keyframe);
  if (images.empty()) return 0;
  const std::size_t list_at = out.position();
  for (const Image& image : images) {
    out.put(image.scan);
    out.put(std::uint32_t{0});
  }
  const std::size_t size_at = out.position();
  out.put(std::uint32_t{0});
  ImageCoder coder(out, bytes);
  for (std::size_t i = 0; i < images.size(); ++i) {
    out.put_at(list_at + 8 * i + 4, coder.put(images[i]));
  }
  coder.finish();
  const std::size_t code_bytes = out.position() - size_at - 4;
  out.put_at(size_at, static_cast<std::uint32_t>(code_bytes));
  return code_bytes;
}

/// Writes the images and returns the bytes of their code.
std::size_t put_images(SpanWriter& out, const WriterInput& input, ImageBytes& bytes) noexcept {
  if (!input.coded_images.empty()) {
    return put_image_list(out, input.coded_images, input.keyframe, bytes);
  }
  return put_image_list(out, input.keyframe.images, input.keyframe, bytes);
}

std::uint16_t flags_of(const KeyframeContent& keyframe) noexcept {
  return static_cast<std::uint16_t>((keyframe.odometry_contradicted ? kOdometryContradicted : 0) |
                                    (is_slip(keyframe.slip) ? kOdometrySlipped : 0));
}

/// What a base needs first: poses and descriptor. Returns where `left_out` stands, which is known
/// at the end.
std::size_t put_summary(SpanWriter& out, const WriterInput& input,
                        std::uint64_t& left_out) noexcept {
  const KeyframeContent& keyframe = input.keyframe;
  out.put(kKeyframeMagic);
  out.put(kKeyframeSchema);
  const bool slipped = is_slip(keyframe.slip);
  out.put(flags_of(keyframe));
  out.put(input.session.robot);
  out.put(input.session.boot.low);
  out.put(input.session.boot.high);
  out.put(keyframe.sequence);
  out.put(keyframe.reference_scan);
  out.put(keyframe.points_in);
  out.put(keyframe.points_dynamic);
  const std::size_t left_out_at = out.position();
  out.put(left_out);
  put_pose(out, keyframe.T_odometry_keyframe);
  out.put(static_cast<std::uint32_t>(keyframe.scans.size()));
  const std::size_t counts_at = out.position();
  out.put(std::uint32_t{0});
  out.put(std::uint32_t{0});
  put_up(out, keyframe.up);
  out.put(cell_size_mm(keyframe.cell_size_m));
  if (slipped) put_slip(out, keyframe.slip);
  put_scan(out, keyframe.scans[keyframe.reference_scan]);
  const std::uint32_t keypoints = put_keypoints(out, keyframe.place.keypoints);
  const std::uint32_t planes = put_planes(out, input.planes);
  out.put_at(counts_at, keypoints);
  out.put_at(counts_at + sizeof keypoints, planes);
  left_out += keyframe.place.keypoints.size() - keypoints + input.planes.size() - planes;
  return left_out_at;
}

}  // namespace

const char* image_head_fault(std::size_t images, const RangeImageShape& shape,
                             float full_weight_range_m) noexcept {
  if (images > kMaxImages) return "a keyframe has too many free-space images";
  if (!is_image_shape(shape)) return "no image has such a field of view";
  // Also false for NaN; one zero, so that there is one spelling.
  const bool is_range = full_weight_range_m >= 0.0F && full_weight_range_m <= 10000.0F &&
                        !std::signbit(full_weight_range_m);
  return is_range ? nullptr : "no image has such a full-weight range";
}

std::uint16_t cell_size_mm(float cell_size_m) noexcept {
  // Also false for NaN.
  if (!(cell_size_m >= kSmallestCellM && cell_size_m <= kLargestCellM)) return 0;
  return static_cast<std::uint16_t>(cell_size_m * 1000.0F + 0.5F);
}

const char* keyframe_fault(const KeyframeContent& keyframe) noexcept {
  if (keyframe.repeats) return "the keyframe repeats earlier ones and is not to be sent";
  if (keyframe.scans.empty()) return "a keyframe has no scans";
  if (keyframe.scans.size() > kMaxScans) return "a keyframe has too many scans";
  if (keyframe.place.keypoints.size() > kMaxKeypoints) return "a keyframe has too many keypoints";
  if (keyframe.place.planes.size() > kMaxPlanes) return "a keyframe has too many planes";
  if (keyframe.reference_scan >= keyframe.scans.size()) return "the reference scan is not there";
  if (const char* fault = image_fault(keyframe)) return fault;
  if (keyframe.points_dynamic > keyframe.points_in) return "more points removed than came in";
  if (cell_size_mm(keyframe.cell_size_m) == 0) return "no keyframe has cells of such a size";
  if (const char* fault = pose_fault(keyframe.T_odometry_keyframe)) return fault;
  if (const char* fault = up_fault(keyframe.up)) return fault;
  if (!keyframe.slip.isZero(0.0F) && !is_slip(keyframe.slip)) return "the slip is no covariance";
  return scan_fault(keyframe.scans);
}

EncodeResult write_keyframe(const WriterInput& input, const WriterScratch& scratch,
                            std::span<std::uint8_t> bytes) noexcept {
  const KeyframeContent& keyframe = input.keyframe;
  EncodeResult result;
  result.left_out = input.left_out;
  SpanWriter out(bytes);
  const std::size_t left_out_at = put_summary(out, input, result.left_out);
  for (std::size_t i = 0; i < keyframe.scans.size(); ++i) {
    if (i != keyframe.reference_scan) put_scan(out, keyframe.scans[i]);
  }
  const CellGrid grid(keyframe.T_odometry_keyframe, cell_size_mm(keyframe.cell_size_m) / 1000.0);
  const auto put_sorted = [&](std::span<const FineCell> cells) {
    const auto keys = sorted_cell_keys(cells, grid, scratch.keys, result.left_out);
    put_cells(out, keys, *scratch.code);
    return keys;
  };
  if (put_intensities(out, put_sorted(keyframe.static_cells))) {
    out.put_at(kFlagsAt, static_cast<std::uint16_t>(flags_of(keyframe) | kHasIntensities));
  }
  put_sorted(keyframe.dynamic_cells);
  result.image_bytes = put_images(out, input, *scratch.images);
  out.put_at(left_out_at, result.left_out);
  result.bytes = out.position();
  if (!out.fits()) {
    result.error = {ErrorCode::kBufferTooSmall, "the buffer is smaller than the encoded keyframe"};
  }
  return result;
}

}  // namespace unimapper::wire
