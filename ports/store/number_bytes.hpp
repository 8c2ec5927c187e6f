// Poses, matrices and lists of numbers as bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::store {

using Bytes = std::vector<std::uint8_t>;

/// Doubles, big-endian, bit for bit.
Bytes to_bytes(std::span<const double> numbers);
/// Nothing where the bytes are no whole numbers.
std::optional<std::vector<double>> to_doubles(std::span<const std::uint8_t> bytes);

/// Rotation by rows, then translation: 96 bytes each.
Bytes to_bytes(std::span<const Pose> poses);
/// Nothing where the bytes are no whole poses.
std::optional<std::vector<Pose>> to_poses(std::span<const std::uint8_t> bytes);

/// 32-bit numbers, big-endian.
Bytes to_bytes(std::span<const std::uint32_t> numbers);
/// Nothing where the bytes are no whole numbers.
std::optional<std::vector<std::uint32_t>> to_numbers(std::span<const std::uint8_t> bytes);

}  // namespace unimapper::store
