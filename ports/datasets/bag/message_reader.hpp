// Bounded reader of the values of a message.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string_view>

#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/record_reader.hpp"

namespace unimapper::datasets::bag {

/// Takes the values of a message in the order of its definition. ROS 1 packs them, little endian.
/// XCDR1 (OMG DDS-XTypes) begins with four bytes that tell the byte order, and aligns every
/// number to its own size, counted behind those four. Throws DatasetError where the message ends
/// too early.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, Serialization serialization) : reader_(bytes) {
    if (serialization == Serialization::kRos1) return;
    // 0 0: big endian, 0 1: little endian; more are other encodings, which no ROS 2 writes.
    const std::string_view representation = reader_.take(kEncapsulationBytes);
    const auto kind = static_cast<std::uint8_t>(representation[1]);
    if (representation[0] != 0 || kind > 1) {
      throw DatasetError("is not in ROS 2's encoding (XCDR1)");
    }
    is_aligned_ = true;
    is_big_endian_ = kind == 0;
  }

  /// The next number (an integer, float or double).
  template <typename T>
  T number() {
    align(sizeof(T));
    std::array<char, sizeof(T)> bytes;
    const std::string_view taken = reader_.take(sizeof(T));
    std::copy(taken.begin(), taken.end(), bytes.begin());
    if (is_big_endian_) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }

  /// The next string, without the zero that CDR ends it with.
  std::string_view text() {
    const auto length = number<std::uint32_t>();
    std::string_view taken = reader_.take(length);
    if (is_aligned_ && taken.ends_with('\0')) taken.remove_suffix(1);
    return taken;
  }

  /// The next `count` bytes.
  std::string_view take(std::uint64_t count) { return reader_.take(count); }

  /// The length of a sequence whose elements take at least `element_bytes` each.
  std::uint32_t count(std::size_t element_bytes) {
    const auto count = number<std::uint32_t>();
    if (count > reader_.left() / element_bytes) {
      throw DatasetError("states " + std::to_string(count) + " elements but ends after " +
                         std::to_string(reader_.left()) + " bytes");
    }
    return count;
  }

  /// Bytes not taken yet.
  [[nodiscard]] std::size_t left() const { return reader_.left(); }
  /// True in the serialization of ROS 1.
  [[nodiscard]] bool is_ros1() const { return !is_aligned_; }
  /// Whether numbers are stored with the highest byte first.
  [[nodiscard]] bool is_big_endian() const { return is_big_endian_; }

 private:
  static constexpr std::size_t kEncapsulationBytes = 4;

  void align(std::size_t bytes) {
    if (!is_aligned_) return;
    const std::size_t past = (reader_.position() - kEncapsulationBytes) % bytes;
    if (past != 0) reader_.take(bytes - past);
  }

  RecordReader reader_;
  bool is_aligned_ = false;
  bool is_big_endian_ = false;
};

}  // namespace unimapper::datasets::bag
