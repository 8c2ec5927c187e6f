// Keys of a robot, and what a base knows of them.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "ports/keys/secret.hpp"

namespace unimapper::keys {

/// A key file that cannot be used or written. The message names the file and the reason.
class KeyError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Shared by a robot and its bases: codes of datagrams in both directions.
using LinkSecret = Secret<32>;
/// A robot's alone: what its Ed25519 key pair is made of.
using SigningSeed = Secret<32>;
/// Of that pair, what others may know: enough to check a signature, not to make one.
using VerifyingKey = std::array<std::uint8_t, 32>;

/// What a robot holds.
struct RobotKey {
  std::string name;         ///< for people; safe as a file name
  std::uint32_t robot = 0;  ///< the robot's number in every message
  LinkSecret link;          ///< of datagrams
  SigningSeed seed;         ///< of signatures
};

/// What a base holds of a robot: it can authenticate datagrams, but sign nothing.
struct BaseKey {
  std::string name;          ///< as on the robot
  std::uint32_t robot = 0;   ///< as on the robot
  bool revoked = false;      ///< nothing of this robot is accepted any more
  LinkSecret link;           ///< of datagrams
  VerifyingKey verifying{};  ///< of signatures
};

/// Keys of a new robot from the kernel's random numbers. `name` must be one that
/// `wire::is_session_name` accepts; throws KeyError otherwise.
[[nodiscard]] RobotKey new_robot_key(const std::string& name);

/// The base's part.
[[nodiscard]] BaseKey base_key_of(const RobotKey& key);

/// Eight hexadecimal digits by which people compare a robot's key with the base's.
[[nodiscard]] std::string fingerprint(const BaseKey& key);

}  // namespace unimapper::keys
