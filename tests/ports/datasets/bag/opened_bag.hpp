// Bags opened from bytes, whole and damaged.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/datasets/fixtures.hpp"

namespace unimapper::datasets::bag {

/// A bag of the given name and bytes.
struct OpenedBag {
  TemporaryDirectory directory;
  std::unique_ptr<MessageSource> source;
  OpenedBag(const std::string& name, std::string_view bytes)
      : source(open_messages(directory.write(name, bytes))) {}
  MessageSource* operator->() const { return source.get(); }
};

/// Messages of all topics in order of log time, a blank behind each.
inline std::string all_messages(MessageSource& source) {
  std::vector<std::size_t> topics;
  for (std::size_t i = 0; i < source.topics().size(); ++i) topics.push_back(i);
  std::string messages;
  for_each_message(source, topics, [&](std::size_t topic, std::size_t number) {
    messages += std::string(source.read(source.messages(topic)[number])) + " ";
  });
  return messages;
}

/// Calls `check(bag, cut, messages)` for the bag cut at every byte, which is refused within the
/// first `magic_bytes` only.
template <typename Check>
void cut_everywhere(const std::string& name, const std::string& bytes, std::size_t magic_bytes,
                    const Check& check) {
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    try {
      const OpenedBag bag(name, bytes.substr(0, cut));
      REQUIRE_FALSE(bag->warnings().empty());
      check(bag, cut, all_messages(*bag.source));
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Catch::Matchers::Contains(name));
      CHECK(cut < magic_bytes);
    }
  }
}

/// Reads the bag with every byte changed: that is an error, a warning, or of no consequence.
inline void change_every_byte(const std::string& name, const std::string& bytes) {
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    try {
      (void)all_messages(*OpenedBag(name, damaged).source);
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Catch::Matchers::Contains(name));
    }
  }
}

}  // namespace unimapper::datasets::bag
