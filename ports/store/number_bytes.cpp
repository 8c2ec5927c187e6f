#include "ports/store/number_bytes.hpp"

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

constexpr std::size_t kNumbersOfPose = 12;

}  // namespace

Bytes to_bytes(std::span<const double> numbers) {
  Bytes bytes;
  bytes.reserve(numbers.size() * sizeof(double));
  wire::BigEndianWriter writer(bytes);
  for (const double number : numbers) writer.put(number);
  return bytes;
}

std::optional<std::vector<double>> to_doubles(std::span<const std::uint8_t> bytes) {
  if (bytes.size() % sizeof(double) != 0) return std::nullopt;
  std::vector<double> numbers(bytes.size() / sizeof(double));
  wire::BigEndianReader reader(bytes);
  for (double& number : numbers) number = reader.get_double();
  return numbers;
}

Bytes to_bytes(std::span<const Pose> poses) {
  std::vector<double> numbers;
  numbers.reserve(poses.size() * kNumbersOfPose);
  for (const Pose& pose : poses) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) numbers.push_back(pose.rotation(row, column));
    }
    for (int row = 0; row < 3; ++row) numbers.push_back(pose.translation[row]);
  }
  return to_bytes(numbers);
}

std::optional<std::vector<Pose>> to_poses(std::span<const std::uint8_t> bytes) {
  const auto numbers = to_doubles(bytes);
  if (!numbers || numbers->size() % kNumbersOfPose != 0) return std::nullopt;
  std::vector<Pose> poses(numbers->size() / kNumbersOfPose);
  auto next = numbers->begin();
  for (Pose& pose : poses) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) pose.rotation(row, column) = *next++;
    }
    for (int row = 0; row < 3; ++row) pose.translation[row] = *next++;
  }
  return poses;
}

Bytes to_bytes(std::span<const std::uint32_t> numbers) {
  Bytes bytes;
  wire::BigEndianWriter writer(bytes);
  for (const std::uint32_t number : numbers) writer.put(number);
  return bytes;
}

std::optional<std::vector<std::uint32_t>> to_numbers(std::span<const std::uint8_t> bytes) {
  if (bytes.size() % sizeof(std::uint32_t) != 0) return std::nullopt;
  std::vector<std::uint32_t> numbers(bytes.size() / sizeof(std::uint32_t));
  wire::BigEndianReader reader(bytes);
  for (std::uint32_t& number : numbers) number = reader.get<std::uint32_t>();
  return numbers;
}

}  // namespace unimapper::store
