// Signatures of encoded keyframes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ports/keys/key.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::keys {

/// Signs keyframes of one robot.
class KeyframeSigner {
 public:
  /// Makes the robot's key pair of its seed.
  explicit KeyframeSigner(const RobotKey& key);

  /// Appends the signature to an encoded keyframe, `kSignatureBytes` and a magic number, which
  /// `wire::split_signature` finds there. Throws std::invalid_argument if it is signed already.
  /// O(bytes).
  void sign(std::vector<std::uint8_t>& keyframe) const;

 private:
  Secret<64> secret_;
};

/// Whether an encoded keyframe is signed, and by this robot. O(bytes).
[[nodiscard]] bool is_signed_by(const VerifyingKey& key, wire::Bytes keyframe);

}  // namespace unimapper::keys
