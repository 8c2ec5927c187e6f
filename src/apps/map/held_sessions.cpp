#include "src/apps/map/held_sessions.hpp"

#include <algorithm>
#include <string>

#include "src/apps/merge/merge_options.hpp"

namespace unimapper::apps {

bool HeldSessions::are_in(const std::vector<std::int64_t>& rows) const {
  return std::all_of(rows_.begin(), rows_.end(), [&](std::int64_t row) {
    return std::find(rows.begin(), rows.end(), row) != rows.end();
  });
}

void HeldSessions::refresh(const std::vector<std::int64_t>& rows) {
  for (const store::SessionListing& listing : reader_.sessions()) {
    if (std::find(rows.begin(), rows.end(), listing.row) != rows.end()) read(listing);
  }
  std::vector<SessionData*> all;
  for (SessionData& session : sessions_) all.push_back(&session);
  tell_names_apart(all);
}

void HeldSessions::read(const store::SessionListing& listing) {
  const auto [found, is_new] = read_.try_emplace(listing.row);
  Read& known = found->second;
  if (is_new) {
    known.index = sessions_.size();
    sessions_.emplace_back();
    rows_.push_back(listing.row);
  }
  SessionData& session = sessions_[known.index];
  if (known.is_whole && known.keyframes == listing.keyframes &&
      known.summaries == listing.summaries) {
    session.complete = listing.ended;
    session.keyframes_missing = listing.missing();
    return;
  }
  known.is_whole = false;
  // What is level by others is so by other ones now.
  if (known.is_levelled) session.keyframes.clear();
  std::erase_if(session.keyframes, [](const KeyframeRecord& k) { return k.is_summary; });
  contents_.read_on(store_, reader_, listing, session);
  known.is_levelled = prepare_session(session) > 0;
  known.keyframes = listing.keyframes;
  known.summaries = listing.summaries;
  known.is_whole = true;
}

}  // namespace unimapper::apps
