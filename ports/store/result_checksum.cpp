// Checksum over all of a stored result.
#include "ports/store/result_checksum.hpp"

#include <optional>
#include <span>
#include <string>

#include "ports/store/number_bytes.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {
namespace {

/// Bytes of everything that is added; lists and text begin with their length.
class Summed {
 public:
  void add(std::int64_t number) {
    const auto bits = static_cast<std::uint64_t>(number);
    for (int shift = 56; shift >= 0; shift -= 8) {
      bytes_.push_back(static_cast<std::uint8_t>(bits >> static_cast<unsigned>(shift)));
    }
  }
  void add(std::span<const std::uint8_t> bytes) {
    add(static_cast<std::int64_t>(bytes.size()));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void add(const std::string& text) {
    add(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  void add(std::span<const double> numbers) {
    add(std::span<const std::uint8_t>(to_bytes(numbers)));
  }
  void add(double number) { add(std::span<const double>(&number, 1)); }
  void add(const std::optional<double>& number) {
    add(std::span<const double>(number ? &*number : nullptr, number ? 1 : 0));
  }
  void add(const Eigen::Vector3d& vector) { add(std::span<const double>(vector.data(), 3)); }
  void add(std::span<const Pose> poses) { add(std::span<const std::uint8_t>(to_bytes(poses))); }
  void add(const Pose& pose) { add(std::span(&pose, 1)); }
  void add(const KeyframeRow& keyframe) {
    add(keyframe.session);
    add(std::int64_t{keyframe.sequence});
  }
  void add_flag(bool flag) { add(std::int64_t{flag ? 1 : 0}); }

  [[nodiscard]] std::int64_t sum() const { return std::int64_t{wire::crc32(bytes_)}; }

 private:
  Bytes bytes_;
};

void add(const SessionResult& session, Summed& all) {
  all.add(session.session);
  all.add(session.state);
  all.add(session.reason);
  all.add(session.T_map_session);
  all.add(
      std::span<const std::uint8_t>(to_bytes(std::span<const std::uint32_t>(session.sequences))));
  all.add(std::span<const Pose>(session.T_map_keyframe));
}

void add(const LoopResult& loop, Summed& all) {
  all.add(loop.query);
  all.add(loop.match);
  all.add(loop.T_match_query);
  if (loop.accepted) all.add(std::span<const double>(loop.information.data(), 36));
  all.add(loop.overlap);
  all.add(static_cast<double>(loop.confidence));
  all.add_flag(loop.accepted);
  all.add_flag(loop.by_person);
  all.add(loop.reason);
}

void add(const PairResult& pair, Summed& all) {
  all.add(pair.match);
  all.add(pair.query);
  all.add(pair.state);
  all.add(pair.reason);
  for (const std::uint64_t count : {pair.loops, pair.distinct, pair.competing}) {
    all.add(static_cast<std::int64_t>(count));
  }
  all.add(pair.T_match_query);
}

void add(const PositionResult& position, Summed& all) {
  all.add(position.keyframe);
  all.add(position.position);
  all.add(position.point);
  all.add(position.sigma_xy_m);
  all.add(position.sigma_z_m);
  all.add_flag(position.used);
  all.add(position.reason);
  all.add(position.residual);
}

template <typename Part>
void add_all(const std::vector<Part>& parts, Summed& all) {
  all.add(static_cast<std::int64_t>(parts.size()));
  for (const Part& part : parts) add(part, all);
}

}  // namespace

std::int64_t checksum_of(const MapResult& result) {
  Summed all;
  all.add(result.parameters);
  add_all(result.sessions, all);
  add_all(result.loops, all);
  add_all(result.pairs, all);
  add_all(result.positions, all);
  if (result.georeference) {
    all.add(result.georeference->origin);
    all.add_flag(result.georeference->is_horizontal);
    all.add(result.georeference->heading_sigma_rad);
  }
  return all.sum();
}

}  // namespace unimapper::store
