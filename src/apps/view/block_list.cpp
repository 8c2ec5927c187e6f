#include "src/apps/view/block_list.hpp"

#include <zlib.h>

#include <utility>

namespace unimapper::apps {

void BlockList::add(const std::string& name, std::string block) {
  Entry& entry = entries_[name];
  entry.bytes = block.size();
  if (file_ == nullptr) {
    entry.block = std::move(block);
  } else {
    entry.offset = file_->append(block.data(), block.size());
  }
}

std::optional<std::string> BlockList::read(const std::string& name) const {
  const auto found = entries_.find(name);
  if (found == entries_.end()) return std::nullopt;
  if (file_ == nullptr) return found->second.block;
  std::string block(found->second.bytes, 0);
  file_->read(found->second.offset, block.data(), block.size());
  return block;
}

std::map<std::string, std::uint64_t> BlockList::sizes() const {
  std::map<std::string, std::uint64_t> sizes;
  for (const auto& [name, entry] : entries_) sizes.emplace(name, entry.bytes);
  return sizes;
}

std::string BlockList::checksum() const {
  uLong sum = crc32(0, nullptr, 0);
  for (const auto& [name, entry] : entries_) {
    for (const std::string& text : {name, *read(name)}) {
      sum = crc32(sum, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
    }
  }
  return std::to_string(sum);
}

}  // namespace unimapper::apps
