// A base on a store, fed with messages.
#pragma once

#include "ports/store/keyframe_store.hpp"
#include "ports/store/store_reader.hpp"
#include "tests/test.hpp"
#include "tests/wire/stream.hpp"

namespace unimapper::store::store_test {

namespace wire_test = wire::wire_test;

constexpr std::int64_t kSecondNs = 1'000'000'000;

/// Commits at every `advance`.
inline StoreOptions impatient() {
  StoreOptions options;
  options.batch_interval_ns = kSecondNs / 2;
  return options;
}

/// What has arrived of a keyframe whose last piece is missing.
inline std::vector<wire_test::Message> most_of(const KeyframeRecord& record) {
  std::vector<wire_test::Message> pieces = wire_test::pieces(record);
  pieces.pop_back();
  return pieces;
}
inline std::vector<wire_test::Message> most_of(const SessionId& id, std::uint32_t sequence) {
  return most_of(wire_test::keyframe_of(id, sequence));
}

struct Base {
  KeyframeStore store;
  wire::Receiver receiver;
  std::int64_t now_ns = 0;

  explicit Base(const std::filesystem::path& folder, const StoreOptions& options = impatient(),
                const wire::ReceiverLimits& limits = {})
      : store(folder, options), receiver(limits, store) {}

  void feed(const std::vector<wire_test::Message>& messages) {
    wire_test::feed(receiver, messages);
  }
  void feed(const SessionId& id, std::uint32_t sequence) {
    feed(wire_test::pieces(wire_test::keyframe_of(id, sequence)));
  }
  /// So many keyframes from the first on.
  void feed_first(const SessionId& id, std::uint32_t keyframes) {
    for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) feed(id, sequence);
  }
  /// A second later.
  void advance() { receiver.advance(now_ns += kSecondNs); }
  /// What is said of every session to be stored: all numbers below.
  std::map<SessionId, std::uint64_t> acknowledged() {
    std::map<SessionId, std::uint64_t> below;
    for (const wire::StoredMessage& message : receiver.take_stored()) {
      below[message.session] = message.below;
    }
    return below;
  }
};

/// Every keyframe of every session, as it is stored.
inline std::map<wire::KeyframeName, std::vector<std::uint8_t>> stored_bytes(
    const std::filesystem::path& folder) {
  StoreReader reader(folder);
  std::map<wire::KeyframeName, std::vector<std::uint8_t>> all;
  for (const SessionListing& session : reader.sessions()) {
    reader.for_each_keyframe(session, [&](StoredKeyframe&& keyframe) {
      if (!keyframe.is_sound) throw StoreError("a checksum is wrong");
      const bool is_new =
          all.emplace(wire::KeyframeName{session.info.id, keyframe.sequence}, keyframe.bytes)
              .second;
      if (!is_new) throw StoreError("a keyframe is stored twice");
    });
  }
  return all;
}

}  // namespace unimapper::store::store_test
