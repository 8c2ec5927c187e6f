// Keyframe record: a keyframe as the base station stores it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper {

/// A `FreeSpaceImage`, owned, in the code of `encode_image`.
struct CodedImage {
  std::uint32_t scan = 0;          ///< index into the keyframe's scans
  std::vector<std::uint8_t> code;  ///< bytes of `encode_image`

  friend bool operator==(const CodedImage&, const CodedImage&) = default;
};

/// One keyframe, owned. Positions as in `KeyframeView`; cells and keypoints carry the wire's
/// quantisation already (half or a third of a cell / 1 mm), on every path the same.
struct KeyframeRecord {
  SessionId session;                 ///< the session it belongs to
  std::uint32_t sequence = 0;        ///< running number in the session, from 0
  std::uint32_t reference_scan = 0;  ///< index into `scans`
  Pose T_odometry_keyframe;          ///< levelled keyframe frame to odometry frame, metres
  KeyframeUp up;                     ///< unknown with older senders
  SlipCovariance slip = SlipCovariance::Zero();  ///< as in `KeyframeContent`
  /// The rest has not arrived yet: cells, images and all scans but the reference scan.
  bool is_summary = false;
  std::vector<KeyframeScan> scans;      ///< in order of time
  float cell_size_m = kFineCellSizeM;   ///< edge of the cells, whose grid is the odometry's
  std::vector<FineCell> static_cells;   ///< levelled keyframe frame, metres
  std::vector<FineCell> dynamic_cells;  ///< what the robot removed, for display and audit
  std::vector<Keypoint> keypoints;      ///< of the descriptor, levelled keyframe frame
  std::vector<PlanePatch> planes;       ///< of older senders; else `PlaneRestorer` finds them
  /// What the keyframe saw through, all in the same shape; none if the robot does not say.
  RangeImageShape image_shape;
  float image_full_weight_range_m = 0.0F;  ///< as in `KeyframeView`
  std::vector<CodedImage> images;          ///< free-space images
  std::uint64_t points_in = 0;             ///< scan points that went into the keyframe
  std::uint64_t points_dynamic = 0;        ///< scan points removed as dynamic
  bool odometry_contradicted = false;      ///< as in `KeyframeContent`
  std::uint64_t left_out = 0;  ///< cells, keypoints and planes too far away for the wire

  /// The descriptor; it points into this record.
  [[nodiscard]] PlaceView place() const { return {keypoints, planes, up}; }
};

/// Cells and images of the keyframes of a session that is held without them.
class KeyframeContents {
 public:
  virtual ~KeyframeContents() = default;
  /// The keyframe that is held as `light`, with cells, in the frame of `light`, and images. Thread
  /// safe; throws where it cannot be read.
  [[nodiscard]] virtual std::shared_ptr<const KeyframeRecord> whole(
      const KeyframeRecord& light) const = 0;
};

/// Everything known of one session, keyframes in ascending `sequence`; gaps are possible.
struct SessionData {
  SessionInfo info;                       ///< identity and names
  std::vector<KeyframeRecord> keyframes;  ///< in ascending `sequence`
  /// Of keyframes that are not among these: each with `is_summary`, in ascending `sequence`.
  std::vector<KeyframeRecord> summaries;
  bool complete = false;                ///< the end-of-session message arrived
  std::uint64_t keyframes_missing = 0;  ///< gaps in `sequence` plus what never reassembled
  std::uint64_t keyframes_damaged = 0;  ///< failed their checksum or validation
  /// Where cells and images of `keyframes` are; null: in `keyframes`.
  std::shared_ptr<const KeyframeContents> contents{};
};

/// Keyframe number `k` of a session with cells and images; while `session` lives.
[[nodiscard]] inline std::shared_ptr<const KeyframeRecord> whole_keyframe(
    const SessionData& session, std::size_t k) {
  const KeyframeRecord& keyframe = session.keyframes[k];
  if (session.contents != nullptr && !keyframe.is_summary) return session.contents->whole(keyframe);
  return {std::shared_ptr<const KeyframeRecord>(), &keyframe};
}

}  // namespace unimapper
