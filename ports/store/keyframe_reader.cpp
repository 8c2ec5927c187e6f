#include "ports/store/keyframe_reader.hpp"

#include <string>
#include <utility>

#include "ports/store/store_file.hpp"
#include "ports/store/store_reader.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::store {

KeyframeReader::KeyframeReader(const std::filesystem::path& folder)
    : database_(open_for_reading(folder)),
      select_(database_, std::string(kSelectKeyframes) + " WHERE session = ? AND sequence = ?") {}

std::vector<std::uint8_t> KeyframeReader::sound_bytes(std::int64_t session,
                                                      std::uint32_t sequence) {
  StoredKeyframe stored;
  const std::lock_guard<std::mutex> lock(guard_);
  select_.bind(session, std::int64_t{sequence});
  if (select_.step()) stored = keyframe_in(select_);
  select_.reset();
  if (!stored.is_sound) stored.bytes.clear();
  return std::move(stored.bytes);
}

void KeyframeReader::refuse(std::int64_t session, std::uint32_t sequence) const {
  throw StoreError(database_.file().string() + ": keyframe " + std::to_string(sequence) +
                   " of session " + std::to_string(session) + " is gone or damaged");
}

std::vector<std::uint8_t> KeyframeReader::bytes(std::int64_t session, std::uint32_t sequence) {
  std::vector<std::uint8_t> bytes = sound_bytes(session, sequence);
  if (bytes.empty()) refuse(session, sequence);
  return bytes;
}

KeyframeRecord KeyframeReader::read(std::int64_t session, std::uint32_t sequence) {
  const std::vector<std::uint8_t> bytes = sound_bytes(session, sequence);
  wire::DecodedKeyframe decoded;
  if (!bytes.empty()) decoded = wire::decode_keyframe(bytes);
  if (!decoded.record) refuse(session, sequence);
  return std::move(*decoded.record);
}

}  // namespace unimapper::store
