// MCAP files made by hand from the format's specification.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tests/ports/datasets/bag/message_writer.hpp"

namespace unimapper::datasets::bag {

inline std::string mcap_text(std::string_view text) {
  return packed(static_cast<std::uint32_t>(text.size())) + std::string(text);
}

inline std::string mcap_record(std::uint8_t opcode, std::string_view content) {
  return packed(opcode, static_cast<std::uint64_t>(content.size())) + std::string(content);
}

inline std::uint32_t mcap_crc(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Puts records together; the summary follows from what was put.
class McapFile {
 public:
  /// Checksums may be left out: 0 says so.
  enum class Checksums : std::uint8_t { kRight, kNone };

  explicit McapFile(Checksums checksums = Checksums::kRight) : checksums_(checksums) {
    bytes_ = kMagic + mcap_record(0x01, mcap_text("ros2") + mcap_text("by hand"));
  }

  /// Describes a topic in front of the records that follow.
  std::uint16_t topic(std::string_view name, std::string_view type,
                      std::string_view encoding = "cdr") {
    const auto id = static_cast<std::uint16_t>(++topics_);
    descriptions_ +=
        mcap_record(0x03, packed(id) + mcap_text(type) + mcap_text("ros2msg") + mcap_text("text"));
    descriptions_ += mcap_record(
        0x04, packed(id, id) + mcap_text(name) + mcap_text(encoding) + packed(std::uint32_t{0}));
    return id;
  }

  /// Adds a message to the open chunk.
  void message(std::uint16_t channel, std::int64_t log_time_ns, std::string_view data) {
    if (chunk_.empty()) chunk_ = descriptions_;
    index_.push_back({channel, static_cast<std::uint64_t>(log_time_ns), chunk_.size()});
    chunk_ += record_of(channel, log_time_ns, data);
  }

  /// Adds a message outside of any chunk.
  void message_outside(std::uint16_t channel, std::int64_t log_time_ns, std::string_view data) {
    if (!is_described_) bytes_ += descriptions_;
    is_described_ = true;
    bytes_ += record_of(channel, log_time_ns, data);
    ++messages_[channel];
  }

  /// Writes the open chunk, uncompressed.
  void end_chunk(bool has_index = true, bool has_right_crc = true) {
    const std::string records = std::move(chunk_);
    chunk_.clear();
    const std::uint64_t start = bytes_.size();
    const std::uint32_t crc = checksum(records) + (has_right_crc ? 0 : 1);
    bytes_ += mcap_record(0x06, packed(index_.front().log_time, index_.back().log_time,
                                       static_cast<std::uint64_t>(records.size()), crc) +
                                    mcap_text("") +
                                    packed(static_cast<std::uint64_t>(records.size())) + records);
    const std::uint64_t end = bytes_.size();
    if (has_index) {
      for (const Entry& entry : index_) {
        bytes_ += mcap_record(
            0x07, packed(entry.channel, std::uint32_t{16}, entry.log_time, entry.offset));
      }
    }
    chunk_indexes_ += mcap_record(
        0x08, packed(index_.front().log_time, index_.back().log_time, start, end - start,
                     std::uint32_t{0}, static_cast<std::uint64_t>(bytes_.size()) - end) +
                  mcap_text("") +
                  packed(static_cast<std::uint64_t>(records.size()),
                         static_cast<std::uint64_t>(records.size())));
    for (const Entry& entry : index_) ++messages_[entry.channel];
    index_.clear();
  }

  /// The file so far: torn.
  [[nodiscard]] const std::string& torn() const { return bytes_; }

  /// The whole file.
  [[nodiscard]] std::string bytes(bool has_summary = true, bool has_right_crc = true,
                                  std::uint64_t more_counted = 0) const {
    std::string file = bytes_ + mcap_record(0x0F, packed(std::uint32_t{0}));
    const std::uint64_t summary_start = has_summary ? file.size() : 0;
    std::string summary;
    if (has_summary) summary = descriptions_ + chunk_indexes_ + statistics(more_counted);
    const std::string footer =
        packed(std::uint8_t{0x02}, std::uint64_t{20}, summary_start, std::uint64_t{0});
    const std::uint32_t crc = checksum(summary + footer) + (has_right_crc ? 0 : 1);
    return file + summary + footer + packed(crc) + kMagic;
  }

 private:
  struct Entry {
    std::uint16_t channel;
    std::uint64_t log_time;
    std::uint64_t offset;
  };

  static std::string record_of(std::uint16_t channel, std::int64_t log_time_ns,
                               std::string_view data) {
    const auto time = static_cast<std::uint64_t>(log_time_ns);
    return mcap_record(0x05, packed(channel, std::uint32_t{0}, time, time) + std::string(data));
  }

  [[nodiscard]] std::string statistics(std::uint64_t more_counted) const {
    std::uint64_t total = more_counted;
    std::string counts;
    for (const auto& [channel, count] : messages_) {
      total += count;
      counts += packed(channel, count);
    }
    return mcap_record(0x0B, packed(total, static_cast<std::uint16_t>(topics_)) +
                                 packed(std::uint32_t{0}, std::uint32_t{0}, std::uint32_t{0},
                                        std::uint32_t{0}, std::uint64_t{0}, std::uint64_t{0}) +
                                 mcap_text(counts));
  }

  [[nodiscard]] std::uint32_t checksum(std::string_view bytes) const {
    return checksums_ == Checksums::kNone ? 0 : mcap_crc(bytes);
  }

  inline static const std::string kMagic = "\x89MCAP0\r\n";
  Checksums checksums_;
  std::string bytes_;
  std::string descriptions_;
  bool is_described_ = false;
  std::string chunk_;
  std::vector<Entry> index_;
  std::string chunk_indexes_;
  std::map<std::uint16_t, std::uint64_t> messages_;
  int topics_ = 0;
};

}  // namespace unimapper::datasets::bag
