#include "ports/delivery/keyframe_head.hpp"

#include "src/wire/keyframe_limits.hpp"

namespace unimapper::delivery {

std::optional<KeyframeHead> read_head(wire::Bytes keyframe) {
  // docs/wire-format.md has the layout.
  wire::LittleEndianReader in(keyframe);
  if (in.get<std::uint32_t>() != wire::kKeyframeMagic) return std::nullopt;
  if (in.get<std::uint16_t>() != wire::kKeyframeSchema) return std::nullopt;
  in.skip(2);
  KeyframeHead head;
  head.session.robot = in.get<std::uint32_t>();
  head.session.boot.low = in.get<std::uint64_t>();
  head.session.boot.high = in.get<std::uint64_t>();
  head.sequence = in.get<std::uint32_t>();
  if (!in.ok()) return std::nullopt;
  return head;
}

}  // namespace unimapper::delivery
