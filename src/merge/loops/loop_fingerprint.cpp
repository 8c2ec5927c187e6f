#include "loop_fingerprint.hpp"

#include <algorithm>
#include <bit>
#include <concepts>
#include <string_view>
#include <utility>

#include "src/core/voxel_key.hpp"

namespace unimapper::merge {
namespace {

/// Order counts; the same on every machine.
class Fingerprint {
 public:
  void add(std::uint64_t bits) { state_ = mix_bits(state_ ^ bits) + 0x9E3779B97F4A7C15ULL; }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(float value) { add(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
  template <std::integral T>
  void add(T value) {
    add(static_cast<std::uint64_t>(value));
  }
  void add(const Eigen::Vector3f& v) {
    for (int i = 0; i < 3; ++i) add(v[i]);
  }
  void add(std::string_view text) {
    add(text.size());
    for (const char letter : text) add(std::uint64_t{static_cast<unsigned char>(letter)});
  }
  void add(const LoopConstraint& loop) {
    add(loop.query.keyframe);
    add(loop.match.keyframe);
    add(loop.T_match_query);
    add(loop.overlap);
    for (const double weight : loop.information.reshaped()) add(weight);
  }
  void add(const Pose& pose) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) add(pose.rotation(row, column));
      add(pose.translation[row]);
    }
  }
  /// All parameters of one struct.
  template <typename Config>
  void add_parameters(const Config& config) {
    Config copy = config;
    for (const Parameter& parameter : kCheckedParameters<Config>) {
      const void* value = parameter.address(&copy);
      switch (parameter.kind) {
        case ParameterKind::kSwitch:
          add(std::uint64_t{*static_cast<const bool*>(value)});
          break;
        case ParameterKind::kCount:
          add(*static_cast<const std::uint32_t*>(value));
          break;
        case ParameterKind::kFloat:
          add(*static_cast<const float*>(value));
          break;
        case ParameterKind::kDouble:
          add(*static_cast<const double*>(value));
          break;
        case ParameterKind::kChoice:
          add(*static_cast<const std::uint8_t*>(value));
          break;
      }
    }
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0;
};

/// Not how candidates are searched for, nor what is done with the outcomes.
std::uint64_t parameters_of_verification(const MergeConfig& config) {
  Fingerprint print;
  print.add(kLoopVerificationVersion);
  print.add_parameters(config.registration);
  print.add(config.loops.min_overlap);
  print.add(config.loops.max_contradiction);
  return print.value();
}

/// Parameters of the placement check, those of the verification among them.
std::uint64_t parameters_of_placement_check(const MergeConfig& config) {
  Fingerprint print;
  print.add(kPlacementCheckVersion);
  print.add(parameters_of_verification(config));
  print.add_parameters(config.odometry);
  print.add_parameters(config.aliasing);
  print.add_parameters(config.radius);
  return print.value();
}

}  // namespace

LoopFingerprints::LoopFingerprints(const std::vector<SessionData>& sessions,
                                   const MergeConfig& config)
    : sessions_(sessions),
      config_(config),
      parameters_(parameters_of_verification(config)),
      placement_parameters_(parameters_of_placement_check(config)) {
  for (const SessionData& session : sessions) {
    records_.emplace_back(session.keyframes.size());
    clouds_.emplace_back(session.keyframes.size());
  }
}

void LoopFingerprints::forget_from(std::size_t session, std::size_t record, std::size_t cloud) {
  if (session >= records_.size()) {
    records_.resize(session + 1);
    clouds_.resize(session + 1);
  }
  for (const auto& [known, first] :
       {std::pair(&records_[session], record), std::pair(&clouds_[session], cloud)}) {
    known->resize(std::min(first, known->size()));
    known->resize(sessions_[session].keyframes.size());
  }
}

std::uint64_t LoopFingerprints::of(KeyframeId query, KeyframeId match,
                                   const CorrectionLimit& limit) {
  Fingerprint print;
  print.add(parameters_);
  print.add(limit.translation_m);
  print.add(limit.rotation_rad);
  print.add(of_cloud(query));
  print.add(of_cloud(match));
  return print.value();
}

std::uint64_t LoopFingerprints::of(const Placement& placement) {
  const LoopConstraint& first = placement.loops.front();
  Fingerprint print;
  print.add(placement_parameters_);
  print.add(of_session(first.query.session));
  print.add(of_session(first.match.session));
  print.add(placement.loops.size());
  for (const LoopConstraint& loop : placement.loops) print.add(loop);
  for (const auto& poses :
       {placement.T_query_session_keyframe, placement.T_match_session_keyframe}) {
    for (const Pose& pose : poses) print.add(pose);
  }
  print.add(placement.T_match_session_query_session);
  print.add(placement.beyond.horizontal_m);
  print.add(placement.beyond.vertical_m);
  for (const CompetingPlacement& other : placement.competing) {
    for (const LoopConstraint& loop : other.loops) print.add(loop);
    print.add(other.T_match_session_query_session);
  }
  print.add(std::uint64_t{placement.is_short ? 1U : 0U});
  // Whether one session goes on where the other one ended.
  for (const std::size_t session : {first.query.session, first.match.session}) {
    const auto& keyframes = sessions_[session].keyframes;
    for (const KeyframeRecord* end : {&keyframes.front(), &keyframes.back()}) {
      for (const KeyframeScan& scan : end->scans)
        print.add(static_cast<std::uint64_t>(scan.stamp_ns));
    }
  }
  return print.value();
}

/// The sensor tells how widely its keyframes look.
std::uint64_t LoopFingerprints::of_session(std::size_t session) {
  Fingerprint print;
  print.add(std::string_view(sessions_[session].info.sensor));
  print.add(sessions_[session].keyframes.size());
  for (std::size_t k = 0; k < sessions_[session].keyframes.size(); ++k) {
    print.add(of_record({session, k}));
  }
  return print.value();
}

std::uint64_t LoopFingerprints::of_cloud(KeyframeId k) {
  std::optional<std::uint64_t>& known = clouds_[k.session][k.keyframe];
  if (known) return *known;
  Fingerprint print;
  for (const std::size_t i : submap_of(sessions_[k.session], k.keyframe).keyframes) {
    print.add(of_record({k.session, i}));
  }
  known = print.value();
  return *known;
}

std::uint64_t LoopFingerprints::of_record(KeyframeId k) {
  std::optional<std::uint64_t>& known = records_[k.session][k.keyframe];
  if (known) return *known;
  const auto whole = whole_keyframe(sessions_[k.session], k.keyframe);
  const KeyframeRecord& record = *whole;
  Fingerprint print;
  print.add(record.sequence);
  print.add(record.T_odometry_keyframe);
  print.add(std::uint64_t{record.up.known});
  for (const float value : {record.up.variance_x, record.up.covariance_xy, record.up.variance_y}) {
    print.add(value);
  }
  print.add(record.cell_size_m);
  for (const auto* cells : {&record.static_cells, &record.dynamic_cells}) {
    print.add(cells->size());
    for (const FineCell& cell : *cells) {
      print.add(cell.position);
      print.add(cell.ground);
    }
  }
  for (const KeyframeScan& scan : record.scans) print.add(scan.T_odometry_sensor);
  print.add(record.image_full_weight_range_m);
  print.add(record.images.size());
  for (const CodedImage& image : record.images) {
    print.add(image.scan);
    print.add(image.code.size());
    for (const std::uint8_t byte : image.code) print.add(byte);
  }
  known = print.value();
  return *known;
}

}  // namespace unimapper::merge
