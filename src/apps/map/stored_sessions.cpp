#include "src/apps/map/stored_sessions.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "src/apps/merge/stored_contents.hpp"

namespace unimapper::apps {

SessionNames::SessionNames(const std::vector<store::SessionListing>& sessions) {
  for (const store::SessionListing& session : sessions) {
    names_[session.row] = session.info.name;
    rows_[session.info.name] = session.row;
  }
}

std::int64_t SessionNames::row(const std::string& name) const {
  const auto found = rows_.find(name);
  if (found != rows_.end()) return found->second;
  std::string known;
  for (const auto& [other, row] : rows_) known += (known.empty() ? "" : ", ") + other;
  throw std::runtime_error("there is no session \"" + name + "\"" +
                           (known.empty() ? "; the store is empty" : ", but there are: " + known));
}

const std::string& SessionNames::name(std::int64_t row) const {
  const auto found = names_.find(row);
  if (found != names_.end()) return found->second;
  throw std::runtime_error("the store has no session " + std::to_string(row));
}

store::KeyframeRow SessionNames::keyframe(const std::string& text) const {
  const std::size_t colon = text.rfind(':');
  std::uint32_t number = 0;
  const char* end = text.data() + text.size();
  const char* begin = colon == std::string::npos ? end : text.data() + colon + 1;
  const auto read = std::from_chars(begin, end, number);
  if (begin == end || read.ec != std::errc() || read.ptr != end) {
    throw std::runtime_error("\"" + text + "\" is no keyframe: write SESSION:NUMBER");
  }
  return {row(text.substr(0, colon)), number};
}

std::string SessionNames::text(const store::KeyframeRow& keyframe) const {
  return name(keyframe.session) + ":" + std::to_string(keyframe.sequence);
}

std::vector<InputSession> read_sessions(const std::filesystem::path& store,
                                        const std::vector<std::int64_t>& rows,
                                        const std::map<std::int64_t, std::set<std::uint32_t>>& only,
                                        StoredContents* contents, SessionOrder order) {
  store::StoreReader reader(store);
  std::vector<InputSession> inputs;
  for (const store::SessionListing& session : reader.sessions()) {
    if (std::find(rows.begin(), rows.end(), session.row) == rows.end()) continue;
    InputSession input{
        contents == nullptr ? reader.read(session) : contents->read(store, reader, session),
        {},
        session.row};
    const auto wanted = only.find(session.row);
    if (wanted != only.end()) {
      const auto is_other = [&](const KeyframeRecord& keyframe) {
        return wanted->second.count(keyframe.sequence) == 0;
      };
      std::erase_if(input.data.keyframes, is_other);
      std::erase_if(input.data.summaries, is_other);
    }
    inputs.push_back(std::move(input));
  }
  prepare_sessions(inputs);
  if (order == SessionOrder::kArrival) {
    std::sort(inputs.begin(), inputs.end(),
              [](const InputSession& a, const InputSession& b) { return a.row < b.row; });
  }
  return inputs;
}

std::vector<SessionData> data_of(std::vector<InputSession>& inputs) {
  std::vector<SessionData> sessions;
  sessions.reserve(inputs.size());
  for (InputSession& input : inputs) sessions.push_back(std::move(input.data));
  return sessions;
}

}  // namespace unimapper::apps
