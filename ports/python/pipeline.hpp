// Pipeline as Python holds it: with its memory, a lock, and what it may be asked at the moment.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <deque>
#include <mutex>

#include "ports/python/arrays.hpp"
#include "ports/python/keyframe.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

namespace unimapper::python {

/// Calls of several threads wait for each other. Asking for what is not there throws
/// std::runtime_error.
class LockedPipeline {
 public:
  /// Throws ValueError for an invalid configuration, std::runtime_error without memory.
  explicit LockedPipeline(const PipelineConfig& config);

  ScanResult add_scan(const PointView& points, const Pose& T_odometry_sensor,
                      std::int64_t stamp_ns);
  ScanResult flush();
  WorkResult work(std::uint32_t budget_us);
  /// `keyframe()` or `finished_keyframe()`.
  std::unique_ptr<Keyframe> keyframe(bool finished);
  std::vector<std::uint8_t> labels(std::int64_t scan_in_keyframe);
  /// Into memory of the caller, which must hold all of the scan's.
  void labels_into(std::int64_t scan_in_keyframe, std::span<std::uint8_t> out);
  RelabelledKeyframe relabelled();
  RelabelledKeyframe relabel_next();
  std::size_t relabel(const PointView& points, const Pose& pose, std::span<std::uint8_t> labels);
  std::vector<std::uint8_t> encode(const SessionId& session);
  void insert_place(const Place& place, KeyframeId id, const Pose& T_session_place);
  const PipelineConfig& config() { return pipeline_->config(); }
  [[nodiscard]] std::size_t bytes() const { return pipeline_.bytes(); }

 private:
  void note(bool ready, bool finished);
  std::size_t points_of_scan(std::int64_t scan_in_keyframe, std::size_t& scan);
  void fill(std::size_t scan, std::span<std::uint8_t> out);
  wire::KeyframeEncoder& encoder();

  std::mutex mutex_;
  OwnedPipeline pipeline_;
  bool ready_ = false;
  bool finished_ = false;
  bool relabelled_ = false;
  std::deque<std::size_t> points_;  ///< of the scans whose labels may still be asked for
  std::size_t first_scan_ = 0;      ///< index of the first of these
  MemoryBlock encoder_memory_;
  wire::KeyframeEncoder encoder_;
};

}  // namespace unimapper::python
