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

KeyframeRecord KeyframeReader::read(std::int64_t session, std::uint32_t sequence) {
  StoredKeyframe stored;
  {
    const std::lock_guard<std::mutex> lock(guard_);
    select_.bind(session, std::int64_t{sequence});
    if (select_.step()) stored = keyframe_in(select_);
    select_.reset();
  }
  wire::DecodedKeyframe decoded;
  if (stored.is_sound) decoded = wire::decode_keyframe(stored.bytes);
  if (!decoded.record) {
    throw StoreError(database_.file().string() + ": keyframe " + std::to_string(sequence) +
                     " of session " + std::to_string(session) + " is gone or damaged");
  }
  return std::move(*decoded.record);
}

}  // namespace unimapper::store
