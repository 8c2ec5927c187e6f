#include "unimapper/wire/keyframe_codec.hpp"

#include <algorithm>
#include <bit>
#include <memory>
#include <stdexcept>

#include "cell_code.hpp"
#include "cell_key.hpp"
#include "image_bytes.hpp"
#include "keyframe_layout.hpp"
#include "keyframe_limits.hpp"
#include "keyframe_writer.hpp"
#include "range_coder.hpp"
#include "signed_keyframe.hpp"
#include "src/core/image_code.hpp"
#include "src/core/quantise.hpp"

namespace unimapper::wire {

namespace {

/// The parts of a record that the writer takes as they are.
KeyframeContent content_of(const KeyframeRecord& record) {
  KeyframeContent content;
  content.sequence = record.sequence;
  content.reference_scan = record.reference_scan;
  content.T_odometry_keyframe = record.T_odometry_keyframe;
  content.up = record.up;
  content.slip = record.slip;
  content.odometry_contradicted = record.odometry_contradicted;
  content.scans = record.scans;
  content.cell_size_m = record.cell_size_m;
  content.static_cells = record.static_cells;
  content.dynamic_cells = record.dynamic_cells;
  content.image_shape = record.image_shape;
  content.image_full_weight_range_m = record.image_full_weight_range_m;
  content.place = record.place();
  content.points_in = record.points_in;
  content.points_dynamic = record.points_dynamic;
  return content;
}

const char* coded_image_fault(const KeyframeRecord& record) {
  if (record.images.empty()) return nullptr;
  if (const char* fault = image_head_fault(record.images.size(), record.image_shape,
                                           record.image_full_weight_range_m)) {
    return fault;
  }
  const std::size_t pixels = ImageProjection(record.image_shape).pixels();
  for (const CodedImage& image : record.images) {
    if (image.scan >= record.scans.size()) return "the scan of a free-space image is not there";
    if (!is_image_code(image.code, pixels)) return "a free-space image is damaged";
  }
  return nullptr;
}

/// Why a record cannot be a keyframe, or null.
const char* record_fault(const KeyframeRecord& record) {
  if (record.is_summary) return "the rest of the keyframe has not arrived";
  const char* fault = keyframe_fault(content_of(record));
  return fault != nullptr ? fault : coded_image_fault(record);
}

/// As many bytes as an encoded record usually takes at most.
std::size_t usual_bytes(const KeyframeRecord& record) {
  const std::size_t cells = record.static_cells.size() + record.dynamic_cells.size();
  std::size_t bytes = kHeadBytes + record.scans.size() * kScanBytes +
                      record.keypoints.size() * kKeypointBytes +
                      record.planes.size() * kPlaneBytes + 100 + 8 * cells + kUpBytes + kSlipBytes;
  for (const CodedImage& image : record.images) bytes += 8 + 2 * image.code.size();
  return bytes;
}

// ---- reading

constexpr const char* kNoRoom = "the keyframe takes more memory than allowed";

/// Memory that cells and images may still take.
class Room {
 public:
  explicit Room(std::uint64_t bytes) : bytes_(bytes) {}

  /// False if there is less left.
  bool take(std::uint64_t bytes) {
    if (bytes > bytes_) return false;
    bytes_ -= bytes;
    return true;
  }

 private:
  std::uint64_t bytes_;
};

Pose get_pose(LittleEndianReader& in) {
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) pose.rotation(row, column) = in.get_double();
  }
  for (int axis = 0; axis < 3; ++axis) pose.translation[axis] = in.get_double();
  return pose;
}

OctahedralNormal get_normal(LittleEndianReader& in) {
  const auto u = in.get<std::int16_t>();
  const auto v = in.get<std::int16_t>();
  return {u, v};
}

const char* read_keypoints(LittleEndianReader& in, std::uint32_t count,
                           std::vector<Keypoint>& keypoints) {
  keypoints.resize(count);
  for (Keypoint& keypoint : keypoints) {
    Eigen::Vector3i steps;
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = in.get<std::int32_t>();
      if (steps[axis] < -kMillimetreLimit || steps[axis] > kMillimetreLimit) {
        return "a keypoint lies beyond the limit";
      }
    }
    const OctahedralNormal normal = get_normal(in);
    if (!is_canonical(normal)) return "a keypoint's normal is not canonical";
    keypoint.position = from_millimetres(steps);
    keypoint.normal = unit_vector(normal);
    keypoint.occupancy = in.get<std::uint64_t>();
    keypoint.strength = in.get<std::uint16_t>();
  }
  return nullptr;
}

const char* read_planes(LittleEndianReader& in, std::uint32_t count,
                        std::vector<PlanePatch>& planes) {
  planes.resize(count);
  for (PlanePatch& plane : planes) {
    Eigen::Vector3i steps;
    for (int axis = 0; axis < 3; ++axis) steps[axis] = in.get<std::int16_t>();
    const OctahedralNormal normal = get_normal(in);
    if (!is_canonical(normal)) return "a plane's normal is not canonical";
    plane.center = from_centimetres(steps);
    plane.normal = unit_vector(normal);
  }
  return nullptr;
}

/// The cell of a key. How many points it had is not known any more.
FineCell cell_of(CellKey key, const CellGrid& grid) noexcept {
  GridPosition at;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto block = static_cast<std::int32_t>((key >> (36U - 8U * axis)) & 0xFFU);
    const auto cell = static_cast<std::int32_t>((key >> (15U - 5U * axis)) & 0x1FU);
    at.cell[axis] = block * kBlockCells + cell;
  }
  at.part = {static_cast<std::int32_t>((key >> 3U) & 1U),
             static_cast<std::int32_t>((key >> 2U) & 1U), static_cast<std::int32_t>(key & 3U)};
  FineCell cell{};
  cell.position = grid.position(at);
  cell.ground = is_ground(key) ? 1 : 0;
  cell.intensity = intensity_of(key);
  return cell;
}

/// Cells as they come out of the coder.
class CellReader {
 public:
  CellReader(const CellGrid& grid, std::uint32_t count, std::vector<FineCell>& cells)
      : grid_(grid), count_(count), cells_(cells) {}

  bool next_block(RangeDecoder& coder, CellCode& code) {
    if (cells_.size() == count_) return false;
    block_ += code.code_gap(coder, 0);
    if (block_ >= kGridBlocks * kGridBlocks * kGridBlocks) return fail("a cell beyond the grid");
    block_ += 1;
    return true;
  }
  bool code_cell(RangeDecoder& coder, CellCode& code, int index) {
    const CellKey cell = (CellKey{block_ - 1} << 20U) | (static_cast<CellKey>(index) << 5U);
    CellKey last = cell;
    bool more = true;
    while (more) {
      if (cells_.size() == count_) return fail("more cells than announced");
      const CellKey key = cell | code.code_detail(coder, index, 0);
      if (coder.exhausted()) return fail("fewer bytes than cells");
      if (key < last) return fail("cells are not sorted");
      last = key;
      cells_.push_back(cell_of(key, grid_));
      more = code.code_more(coder, false);
    }
    return true;
  }
  [[nodiscard]] const char* fault() const { return fault_; }

 private:
  bool fail(const char* fault) {
    fault_ = fault;
    return false;
  }

  const CellGrid& grid_;
  std::uint32_t count_;
  std::vector<FineCell>& cells_;
  std::uint32_t block_ = 0;  ///< one past the last
  const char* fault_ = nullptr;
};

const char* read_cells(LittleEndianReader& in, const CellGrid& grid,
                       std::unique_ptr<CellCode>& code, Room& room, std::vector<FineCell>& cells) {
  const auto count = in.get<std::uint32_t>();
  const Bytes bytes = in.get_bytes(in.get<std::uint32_t>());
  if (!in.ok() || count / kMostCellsPerByte > bytes.size()) return "fewer bytes than cells";
  if (count > kMaxCells) return "a count is beyond the limit";
  if (count == 0) return bytes.empty() ? nullptr : "bytes of cells are left over";
  if (!room.take(count * std::uint64_t{sizeof(FineCell)})) return kNoRoom;
  cells.reserve(count);
  RangeDecoder coder(bytes);
  CellReader reader(grid, count, cells);
  if (code == nullptr) code = std::make_unique<CellCode>();
  code_cells(coder, *code, reader);
  if (reader.fault() != nullptr) return reader.fault();
  return coder.ends_here() ? nullptr : "the code of the cells is not the one of these cells";
}

/// Of equal cells the intensities do not descend, as their order says nothing.
const char* read_intensities(LittleEndianReader& in, std::vector<FineCell>& cells) {
  const Bytes bytes = in.get_bytes(cells.size());
  if (!in.ok()) return "fewer bytes than intensities";
  bool is_known = false;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i].intensity = bytes[i];
    is_known = is_known || bytes[i] != 0;
    const bool repeats = i > 0 && cells[i].position == cells[i - 1].position &&
                         cells[i].ground == cells[i - 1].ground;
    if (repeats && bytes[i] < bytes[i - 1]) return "intensities are not sorted";
  }
  return is_known ? nullptr : "no intensity is known";
}

void read_cell_size(LittleEndianReader& in, KeyframeRecord& record) {
  record.cell_size_m = static_cast<float>(in.get<std::uint16_t>()) / 1000.0F;
}

const char* read_cell_lists(LittleEndianReader& in, bool has_intensities, Room& room,
                            KeyframeRecord& record) {
  // Whatever the grid depends on.
  if (const char* fault = keyframe_fault(content_of(record))) return fault;
  std::unique_ptr<CellCode> code;  // which is large
  const CellGrid grid(record.T_odometry_keyframe, cell_size_mm(record.cell_size_m) / 1000.0);
  if (const char* fault = read_cells(in, grid, code, room, record.static_cells)) return fault;
  if (has_intensities) {
    if (const char* fault = read_intensities(in, record.static_cells)) return fault;
  }
  return read_cells(in, grid, code, room, record.dynamic_cells);
}

const char* read_image_code(LittleEndianReader& in, const std::vector<std::uint32_t>& sizes,
                            KeyframeRecord& record) {
  const Bytes bytes = in.get_bytes(in.get<std::uint32_t>());
  if (!in.ok()) return "fewer bytes than images";
  RangeDecoder coder(bytes);
  const auto models = std::make_unique<ImageBytes>();
  models->reset();
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    models->start_image();
    std::vector<std::uint8_t>& code = record.images[i].code;
    for (std::uint32_t n = 0; n < sizes[i]; ++n) {
      code.push_back(models->code(coder, 0));
      if (coder.exhausted()) return "fewer bytes than images";
    }
  }
  return coder.ends_here() ? nullptr : "the code of the images is not the one of these images";
}

const char* read_images(LittleEndianReader& in, Room& room, KeyframeRecord& record) {
  const auto count = in.get<std::uint32_t>();
  if (!in.ok()) return "fewer bytes than images";
  if (count == 0) return nullptr;
  if (count > kMaxImages) return "a count is beyond the limit";
  RangeImageShape& shape = record.image_shape;
  for (float* angle_deg :
       {&shape.horizontal_fov_deg, &shape.azimuth_resolution_deg, &shape.elevation_min_deg,
        &shape.elevation_max_deg, &shape.elevation_resolution_deg}) {
    *angle_deg = in.get_float();
  }
  record.image_full_weight_range_m = in.get_float();
  if (const char* fault = image_head_fault(count, shape, record.image_full_weight_range_m)) {
    return fault;
  }
  const std::size_t most = max_image_code(ImageProjection(shape).pixels());
  std::vector<std::uint32_t> sizes(count);
  record.images.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    record.images[i].scan = in.get<std::uint32_t>();
    sizes[i] = in.get<std::uint32_t>();
    if (sizes[i] > most) return "a free-space image is damaged";
    if (!room.take(sizes[i])) return kNoRoom;
  }
  return read_image_code(in, sizes, record);
}

const char* read_up(LittleEndianReader& in, KeyframeUp& up) {
  up.variance_x = in.get_float();
  up.covariance_xy = in.get_float();
  up.variance_y = in.get_float();
  if (!in.ok()) return "fewer bytes than the covariance of up";
  up.known = up.variance_x > 0.0F;
  if (up.known) return nullptr;
  // One spelling of "unknown"; negative zeros are another.
  for (const float value : {up.variance_x, up.covariance_xy, up.variance_y}) {
    if (std::bit_cast<std::uint32_t>(value) != 0) return "the covariance of up is none";
  }
  return nullptr;
}

const char* read_slip(LittleEndianReader& in, SlipCovariance& slip) {
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      slip(row, column) = in.get_float();
      slip(column, row) = slip(row, column);
    }
  }
  return is_slip(slip) ? nullptr : "the slip is no covariance";
}

/// How much there is of what follows the head.
struct RecordHead {
  std::uint32_t scans = 0;
  std::uint32_t keypoints = 0;
  std::uint32_t planes = 0;
  bool slipped = false;
  bool has_intensities = false;
};

const char* read_head(LittleEndianReader& in, RecordHead& head, KeyframeRecord& record) {
  if (in.get<std::uint32_t>() != kKeyframeMagic) return "not a keyframe";
  if (in.get<std::uint16_t>() != kKeyframeSchema) return "unknown schema version";
  const auto flags = in.get<std::uint16_t>();
  constexpr std::uint16_t kFlags = kOdometryContradicted | kOdometrySlipped | kHasIntensities;
  if ((flags & ~kFlags) != 0) return "unknown flags";
  head.has_intensities = (flags & kHasIntensities) != 0;
  head.slipped = (flags & kOdometrySlipped) != 0;
  record.odometry_contradicted = (flags & kOdometryContradicted) != 0;
  record.session.robot = in.get<std::uint32_t>();
  record.session.boot.low = in.get<std::uint64_t>();
  record.session.boot.high = in.get<std::uint64_t>();
  record.sequence = in.get<std::uint32_t>();
  record.reference_scan = in.get<std::uint32_t>();
  record.points_in = in.get<std::uint64_t>();
  record.points_dynamic = in.get<std::uint64_t>();
  record.left_out = in.get<std::uint64_t>();
  record.T_odometry_keyframe = get_pose(in);
  head.scans = in.get<std::uint32_t>();
  head.keypoints = in.get<std::uint32_t>();
  head.planes = in.get<std::uint32_t>();
  if (!in.ok()) return "shorter than a keyframe's head";
  if (head.scans > kMaxScans || head.keypoints > kMaxKeypoints || head.planes > kMaxPlanes) {
    return "a count is beyond the limit";
  }
  if (record.reference_scan >= head.scans) {
    return head.scans == 0 ? "a keyframe has no scans" : "the reference scan is not there";
  }
  return nullptr;
}

KeyframeScan get_scan(LittleEndianReader& in) {
  KeyframeScan scan;
  scan.scan_index = in.get<std::uint32_t>();
  scan.stamp_ns = in.get<std::int64_t>();
  scan.T_odometry_sensor = get_pose(in);
  return scan;
}

std::size_t summary_size(const RecordHead& head) {
  return kHeadBytes + kUpBytes + kCellEdgeBytes + (head.slipped ? kSlipBytes : 0) + kScanBytes +
         head.keypoints * kKeypointBytes + head.planes * kPlaneBytes;
}

/// After the head; the reference scan is the only one.
const char* read_summary(LittleEndianReader& in, const RecordHead& head, KeyframeRecord& record) {
  if (summary_size(head) - kHeadBytes > in.remaining()) {
    return "fewer bytes than keypoints and planes";
  }
  if (const char* fault = read_up(in, record.up)) return fault;
  read_cell_size(in, record);
  if (head.slipped) {
    if (const char* fault = read_slip(in, record.slip)) return fault;
  }
  record.scans.assign(1, get_scan(in));
  if (const char* fault = read_keypoints(in, head.keypoints, record.keypoints)) return fault;
  return read_planes(in, head.planes, record.planes);
}

const char* read_record(LittleEndianReader& in, Room room, KeyframeRecord& record) {
  RecordHead head;
  if (const char* fault = read_head(in, head, record)) return fault;
  if (const char* fault = read_summary(in, head, record)) return fault;
  if ((head.scans - 1) * kScanBytes > in.remaining()) return "fewer bytes than scans";
  const KeyframeScan reference = record.scans.front();
  record.scans.resize(head.scans);
  for (std::uint32_t i = 0; i < head.scans; ++i) {
    record.scans[i] = i == record.reference_scan ? reference : get_scan(in);
  }
  if (const char* fault = read_cell_lists(in, head.has_intensities, room, record)) return fault;
  if (const char* fault = read_images(in, room, record)) return fault;
  if (in.remaining() != 0) return "bytes are left over";
  return record_fault(record);
}

/// The record of a summary: a keyframe whose reference scan is its only one.
const char* read_summary_record(LittleEndianReader& in, KeyframeRecord& record) {
  RecordHead head;
  if (const char* fault = read_head(in, head, record)) return fault;
  if (const char* fault = read_summary(in, head, record)) return fault;
  record.reference_scan = 0;
  const char* fault = record_fault(record);
  record.is_summary = true;
  return fault;
}

DecodedKeyframe as_decoded(const char* fault, const LittleEndianReader& in, std::size_t bytes,
                           KeyframeRecord&& record) {
  DecodedKeyframe decoded;
  if (fault == nullptr) {
    decoded.record = std::move(record);
  } else {
    decoded.error = std::string(fault) + " (at byte " + std::to_string(in.position()) + " of " +
                    std::to_string(bytes) + ")";
  }
  return decoded;
}

}  // namespace

std::vector<std::uint8_t> encode_keyframe(const KeyframeRecord& record) {
  if (const char* fault = record_fault(record)) throw std::invalid_argument(fault);
  const KeyframeContent content = content_of(record);
  const std::size_t cells = std::min<std::size_t>(
      std::max(record.static_cells.size(), record.dynamic_cells.size()), kMaxCells);
  std::vector<CellKey> keys(2 * cells);
  std::vector<std::uint32_t> counts(CellKeyScratch::kCounts);
  const auto code = std::make_unique<CellCode>();
  const auto images = std::make_unique<ImageBytes>();
  const WriterScratch scratch{
      {std::span(keys).first(cells), std::span(keys).subspan(cells), counts},
      code.get(),
      images.get()};
  const WriterInput input{content, record.session, record.left_out, record.planes, record.images};
  std::vector<std::uint8_t> bytes(usual_bytes(record));
  EncodeResult result = write_keyframe(input, scratch, bytes);
  const bool fits = result.bytes <= bytes.size();
  bytes.resize(result.bytes);
  if (!fits) result = write_keyframe(input, scratch, bytes);
  return bytes;
}

DecodedKeyframe decode_keyframe(Bytes bytes, std::uint64_t max_record_bytes) {
  LittleEndianReader in(split_signature(bytes).keyframe);
  KeyframeRecord record;
  const char* fault = read_record(in, Room(max_record_bytes), record);
  return as_decoded(fault, in, bytes.size(), std::move(record));
}

static_assert(kSummaryHeadBytes == kHeadBytes);

std::optional<std::size_t> summary_bytes(Bytes bytes) {
  LittleEndianReader in(bytes);
  RecordHead head;
  KeyframeRecord record;
  if (read_head(in, head, record) != nullptr) return std::nullopt;
  return summary_size(head);
}

DecodedKeyframe decode_summary(Bytes bytes) {
  LittleEndianReader in(bytes);
  KeyframeRecord record;
  const char* fault = read_summary_record(in, record);
  return as_decoded(fault, in, bytes.size(), std::move(record));
}

}  // namespace unimapper::wire
