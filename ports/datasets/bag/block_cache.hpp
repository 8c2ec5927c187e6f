// Least-recently-used cache of decompressed blocks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <list>
#include <string>
#include <utility>

namespace unimapper::datasets::bag {

/// Keeps the blocks used last, together `kMostBytes` or one block.
class BlockCache {
 public:
  /// The block, made by `make()` where it is not kept. Valid until the next call.
  template <typename Make>
  const std::string& get(std::uint32_t number, const Make& make) {
    const auto kept = std::find_if(blocks_.begin(), blocks_.end(),
                                   [number](const auto& block) { return block.first == number; });
    if (kept != blocks_.end()) {
      blocks_.splice(blocks_.begin(), blocks_, kept);
    } else {
      blocks_.emplace_front(number, make());
      bytes_ += blocks_.front().second.size();
      while (blocks_.size() > 1 && bytes_ > kMostBytes) {
        bytes_ -= blocks_.back().second.size();
        blocks_.pop_back();
      }
    }
    return blocks_.front().second;
  }

 private:
  static constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  std::list<std::pair<std::uint32_t, std::string>> blocks_;  ///< used last: first
  std::size_t bytes_ = 0;
};

}  // namespace unimapper::datasets::bag
