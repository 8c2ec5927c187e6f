// Sessions of stores whose cells are read when they are needed.
#include "src/apps/merge/stored_contents.hpp"

namespace unimapper::apps {

SessionData StoredContents::read(const std::filesystem::path& folder, store::StoreReader& reader,
                                 const store::SessionListing& session) {
  std::shared_ptr<store::KeyframeReader>& keyframes = readers_[folder];
  if (keyframes == nullptr) keyframes = std::make_shared<store::KeyframeReader>(folder);
  const auto contents = cache_.contents([keyframes, row = session.row](std::uint32_t sequence) {
    return keyframes->read(row, sequence);
  });
  SessionData data = reader.read(session, [&](KeyframeRecord& keyframe) {
    // One whose up is not known will be turned.
    if (keyframe.up.known) contents->offer(keyframe);
    merge::drop_contents(keyframe);
  });
  data.contents = contents;
  return data;
}

void StoredContents::read_on(const std::filesystem::path& folder, store::StoreReader& reader,
                             const store::SessionListing& session, SessionData& data) {
  if (data.contents == nullptr) {
    data = read(folder, reader, session);
  } else {
    reader.read_on(session, data, merge::drop_contents);
  }
}

}  // namespace unimapper::apps
