// Source of a map that a page shows, and of what people change about it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "src/apps/map/loop_statement.hpp"
#include "src/apps/view/event_stream.hpp"

namespace unimapper::apps {

/// What became of a change that a person asked for.
struct ViewAnswer {
  int status = 200;     ///< of HTTP
  std::string message;  ///< JSON (docs/api.md)
};

/// The answer where nothing may be changed.
[[nodiscard]] inline ViewAnswer cannot_change() {
  return {403, R"({"error":"this map cannot be changed"})"};
}

/// A loop by its keyframes, "SESSION:NUMBER" each, in either order: its index, and which of them is
/// the query, may differ after a merge.
struct NamedLoop {
  std::string query;
  std::string match;
};

/// A map that is shown: in files, in a store, or while it grows. Thread safe; functions throw
/// std::exception, in words, where nothing can be shown.
class ViewSource {
 public:
  virtual ~ViewSource() = default;

  /// `api/map`, as of an epoch; 0: as it is now.
  [[nodiscard]] virtual std::shared_ptr<const std::string> map_json(std::int64_t epoch) = 0;
  /// A block of a layer, gzip; nothing if there is none. `version`: as `api/map` names it.
  [[nodiscard]] virtual std::optional<std::string> block(const std::string& version,
                                                         const std::string& layer,
                                                         const std::string& key) = 0;
  /// Points of a keyframe in its own frame, gzip; nothing if there is none.
  [[nodiscard]] virtual std::optional<std::string> keyframe(const std::string& version,
                                                            std::size_t session,
                                                            std::size_t keyframe) = 0;
  /// `api/health`.
  [[nodiscard]] virtual std::string health_json() { return R"({"robots":[],"alarms":[]})"; }
  /// Changes the map, which may take as long as a merge.
  [[nodiscard]] virtual ViewAnswer decide(const NamedLoop& loop, LoopStatement statement,
                                          std::int64_t epoch) {
    (void)loop, (void)statement, (void)epoch;
    return cannot_change();
  }
  /// Goes back from the latest epoch, which is `epoch`, to the one before.
  [[nodiscard]] virtual ViewAnswer undo(std::int64_t epoch) {
    (void)epoch;
    return cannot_change();
  }

  /// What happens.
  [[nodiscard]] EventStream& events() { return events_; }

 private:
  EventStream events_;
};

}  // namespace unimapper::apps
