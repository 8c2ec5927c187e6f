// Messages with their channels as a stream of bytes.
#pragma once

#include <unistd.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace unimapper::store::store_test {

/// Reads frames of a pipe: bytes of the channel (u8), of the message (u32, little-endian), both.
class Frames {
 public:
  struct Frame {
    std::string channel;
    std::vector<std::uint8_t> data;
  };

  /// Not inlined: GCC 12 at -O3 takes the message's end for the end of an array.
  [[gnu::noinline]] static std::vector<std::uint8_t> frame(std::string_view channel,
                                                           const std::vector<std::uint8_t>& data) {
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(channel.size())};
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<std::uint8_t>(data.size() >> shift));
    }
    bytes.insert(bytes.end(), channel.begin(), channel.end());
    bytes.insert(bytes.end(), data.begin(), data.end());
    return bytes;
  }

  /// False at the end of the stream.
  bool read_from(int descriptor) {
    std::array<std::uint8_t, 65536> chunk{};
    const ssize_t count = read(descriptor, chunk.data(), chunk.size());
    if (count <= 0) return false;
    buffer_.insert(buffer_.end(), chunk.begin(), chunk.begin() + count);
    return true;
  }
  std::optional<Frame> next() {
    constexpr std::size_t kHead = 5;
    if (buffer_.size() - at_ < kHead) return compact();
    const std::size_t channel = buffer_[at_];
    std::size_t size = 0;
    for (std::size_t i = 4; i > 0; --i) size = size << 8U | buffer_[at_ + i];
    if (buffer_.size() - at_ < kHead + channel + size) return compact();
    const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(at_ + kHead);
    const auto middle = begin + static_cast<std::ptrdiff_t>(channel);
    Frame frame{{begin, middle}, {middle, middle + static_cast<std::ptrdiff_t>(size)}};
    at_ += kHead + channel + size;
    return frame;
  }

 private:
  std::nullopt_t compact() {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ = 0;
    return std::nullopt;
  }

  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;
};

}  // namespace unimapper::store::store_test
