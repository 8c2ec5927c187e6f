// Robot's key at work: datagrams authenticated, keyframes signed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "ports/lcm/datagram_guard.hpp"
#include "unimapper/core/ids.hpp"

namespace unimapper::delivery {

/// What a robot does with its key, whether or not this library was built with `ports/keys`.
class Authentication {
 public:
  virtual ~Authentication() = default;
  /// The robot's number in every message.
  [[nodiscard]] virtual std::uint32_t robot() const = 0;
  /// A guard of the datagrams of this start. It may outlive this object.
  [[nodiscard]] virtual std::shared_ptr<lcm_port::DatagramGuard> guard(const BootId& boot) = 0;
  /// Appends the signature to an encoded keyframe. Throws std::invalid_argument if it has one.
  /// O(bytes).
  virtual void sign(std::vector<std::uint8_t>& keyframe) const = 0;
  /// Answers that the guard refused so far. Thread safe.
  [[nodiscard]] virtual std::uint64_t refused() const = 0;
};

/// Reads a key file. Throws Refusal: EACCES for one that cannot be used, ENOTSUP without
/// `ports/keys`.
[[nodiscard]] std::unique_ptr<Authentication> read_authentication(
    const std::filesystem::path& key_file);

}  // namespace unimapper::delivery
