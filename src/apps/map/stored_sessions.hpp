// Names and data of the sessions in a stored project.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "ports/store/store_reader.hpp"
#include "src/apps/merge/merge_options.hpp"

namespace unimapper::apps {

/// Sessions of a store by row and by name, as `unimapper inspect` shows them.
class SessionNames {
 public:
  explicit SessionNames(const std::vector<store::SessionListing>& sessions);

  /// Throws std::runtime_error with the known names.
  [[nodiscard]] std::int64_t row(const std::string& name) const;
  [[nodiscard]] const std::string& name(std::int64_t row) const;
  /// "SESSION:NUMBER". Throws std::runtime_error for what is none.
  [[nodiscard]] store::KeyframeRow keyframe(const std::string& text) const;
  [[nodiscard]] std::string text(const store::KeyframeRow& keyframe) const;

 private:
  std::map<std::int64_t, std::string> names_;
  std::map<std::string, std::int64_t> rows_;
};

/// Order in which sessions are numbered: by name, as in every merge, or as they came into the
/// store, in which a new one changes no other's number.
enum class SessionOrder : std::uint8_t { kName, kArrival };

/// The given sessions, ready for a merge. `only`: of a session that is in it, these keyframes
/// alone. `contents`: cells are read on demand; null: at once.
std::vector<InputSession> read_sessions(const std::filesystem::path& store,
                                        const std::vector<std::int64_t>& rows,
                                        const std::map<std::int64_t, std::set<std::uint32_t>>& only,
                                        StoredContents* contents,
                                        SessionOrder order = SessionOrder::kName);

/// Moves the data out of sessions, whose rows stay.
std::vector<SessionData> data_of(std::vector<InputSession>& inputs);

}  // namespace unimapper::apps
