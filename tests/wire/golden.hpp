// Bytes of the small record, part by part.
#pragma once

#include "tests/test.hpp"

namespace unimapper::wire::wire_test {

/// Bytes written as hexadecimal digits, with blanks where they help the eye.
inline std::vector<std::uint8_t> bytes_of(const std::string& digits) {
  std::string pairs = digits;
  std::erase(pairs, ' ');
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < pairs.size(); at += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(pairs.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

/// The bytes with some of them replaced.
inline std::vector<std::uint8_t> forged(std::vector<std::uint8_t> bytes, std::size_t at,
                                        const std::string& digits) {
  const std::vector<std::uint8_t> replacement = bytes_of(digits);
  std::copy(replacement.begin(), replacement.end(),
            bytes.begin() + static_cast<std::ptrdiff_t>(at));
  return bytes;
}

/// Offsets of fields in the encoded small record.
inline constexpr std::size_t kSchemaAt = 4;
inline constexpr std::size_t kReferenceScanAt = 32;
inline constexpr std::size_t kPoseAt = 60;
inline constexpr std::size_t kScanCountAt = 156;
inline constexpr std::size_t kUpAt = 168;
inline constexpr std::size_t kCellEdgeAt = kUpAt + 12;
inline constexpr std::size_t kSummaryEnd = kCellEdgeAt + 2 + 108 + 26 + 10;
inline constexpr std::size_t kCellsAt = kSummaryEnd + 108;

inline const std::string kOne = "000000000000F03F";
inline const std::string kZero = "0000000000000000";
inline const std::string kRotation =
    kOne + kZero + kZero + kZero + kOne + kZero + kZero + kZero + kOne;
inline const std::string kMoved = "000000000000F83F 00000000000000C0 000000000000D03F";

/// Parts of the small record: index, stamp and pose of its scans.
inline const std::string kFirstScan =
    "A4010000 00CA9A3B00000000" + kRotation + kZero + kZero + kZero;
inline const std::string kSecondScan = "A5010000 00AB904100000000" + kRotation + kMoved;
/// Its keypoint (millimetres, normal, occupancy, strength) and plane (centimetres, normal).
inline const std::string kDescriptor =
    "D2040000 D2E9FFFF 28230000 2449 FF7F F0F0000000000000 0102 2C01 9001 56FF 0000 0000";
/// Covariance of up: 2^-12, -2^-14, 2^-13 rad^2.
inline const std::string kUp = "00008039 000080B8 00000039";
inline const std::string kCellEdge = "C800";  // 200 mm
inline const std::string kCodedCells =
    "02000000 12000000"                     // static cells: cells, bytes
    "FFFFFDFFC320E0181A03A0901CAB9C5ECF90"  // their code
    "01000000 0F000000"                     // dynamic cells: cells, bytes
    "FFFFFDFAC39881E510802B02700000";       // their code
inline const std::string kCodedImages =
    "01000000"                                      // images
    "0000B442 0000F041 00000000 0000F041 0000F041"  // shape
    "00008042"                                      // full weight up to 64 m
    "01000000 04000000"                             // scan, bytes
    "08000000 00E055FD18000000";                    // bytes of all images, their code

/// The small record up to its counts.
inline const std::string kHead =
    "554D4B46 0600 0000 "                                 // magic, schema, reserved
    "07000000 EFCDAB8967452301 1032547698BADCFE "         // robot, boot
    "2A000000 01000000 "                                  // sequence, reference scan
    "E803000000000000 0A00000000000000 0000000000000000"  // points in, dynamic, left out
    + kRotation + kMoved                                  // T_odometry_keyframe
    + "02000000 01000000 01000000";                       // scans, keypoints, planes

}  // namespace unimapper::wire::wire_test
