// Blocks of points by name, in memory or in a temporary file.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "unimapper/merge/external_vector.hpp"

namespace unimapper::apps {

/// Blocks that are added once and read as often as needed.
class BlockList {
 public:
  BlockList() = default;
  /// `file`: null keeps them in memory.
  explicit BlockList(std::shared_ptr<merge::ScratchFile> file) : file_(std::move(file)) {}

  /// A name that is there already is replaced. Throws std::runtime_error where the file cannot be
  /// written.
  void add(const std::string& name, std::string block);
  /// Nothing if there is no such block. Throws std::runtime_error where the file cannot be read.
  [[nodiscard]] std::optional<std::string> read(const std::string& name) const;

  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Bytes by name.
  [[nodiscard]] std::map<std::string, std::uint64_t> sizes() const;
  /// CRC-32 of all names and blocks, in digits. Throws as `read`.
  [[nodiscard]] std::string checksum() const;

 private:
  struct Entry {
    std::string block;  ///< empty: in the file
    std::uint64_t bytes = 0;
    std::uint64_t offset = 0;
  };
  std::shared_ptr<merge::ScratchFile> file_;
  std::map<std::string, Entry> entries_;
};

}  // namespace unimapper::apps
