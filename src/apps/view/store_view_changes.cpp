// Changes of a stored map that people ask for.
#include <exception>
#include <nlohmann/json.hpp>

#include "ports/store/project_writer.hpp"
#include "src/apps/map/stored_result.hpp"
#include "src/apps/view/store_view.hpp"

namespace unimapper::apps {
namespace {

std::string error_in_json(const std::string& why) {
  return nlohmann::ordered_json{{"error", why}}.dump(
      -1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

ViewAnswer StoreView::change(std::int64_t epoch,
                             const std::function<store::Epoch(store::ProjectWriter&)>& make) {
  if (!options_.may_change || options_.epoch > 0) return cannot_change();
  const std::lock_guard one_at_a_time(changing_);
  try {
    store::ProjectWriter writer = options_.held != nullptr
                                      ? store::ProjectWriter(options_.store, *options_.held)
                                      : store::ProjectWriter(options_.store, "a page of the map");
    if (writer.current().epoch.number != epoch) {
      return {409, error_in_json("the map has changed since epoch " + std::to_string(epoch))};
    }
    const store::Epoch made = make(writer);
    return {200, nlohmann::ordered_json{{"epoch", made.number}, {"outcome", made.outcome}}.dump()};
  } catch (const std::exception& error) {
    return {409, error_in_json(error.what())};
  }
}

/// Under `mutex_`.
std::optional<StatedLoop> StoreView::find(const NamedLoop& named) const {
  const KeyframeRows rows(shown_.rows, shown_.sessions);
  const auto keyframe = [&](KeyframeId k) -> const KeyframeRecord& {
    return shown_.sessions[k.session].keyframes[k.keyframe];
  };
  const auto is_named = [&](std::optional<KeyframeId> query, std::optional<KeyframeId> match) {
    const auto name = [&](KeyframeId k) {
      return shown_.sessions[k.session].info.name + ":" + std::to_string(keyframe(k).sequence);
    };
    if (!query || !match) return false;
    const std::string a = name(*query);
    const std::string b = name(*match);
    return (a == named.query && b == named.match) || (a == named.match && b == named.query);
  };
  for (const merge::LoopConstraint& loop : shown_.merged.loops) {
    if (!is_named(loop.query, loop.match)) continue;
    return StatedLoop{rows.row(loop.query), rows.row(loop.match),
                      merge::reference_sensor_pose(keyframe(loop.match)).inverse() *
                          loop.T_match_query * merge::reference_sensor_pose(keyframe(loop.query))};
  }
  // One that is forbidden may be proposed no more.
  for (const store::StoredStatement& statement : shown_.statements) {
    if (statement.kind != store::StatementKind::kForbidden) continue;
    if (!is_named(rows.find(statement.query), rows.find(statement.match))) continue;
    return StatedLoop{statement.query, statement.match, std::nullopt};
  }
  return std::nullopt;
}

ViewAnswer StoreView::decide(const NamedLoop& loop, LoopStatement statement, std::int64_t epoch) {
  std::optional<StatedLoop> stated;
  {
    const std::lock_guard lock(mutex_);
    if (shown_.epoch == epoch) stated = find(loop);
  }
  if (!stated) {
    return {409, error_in_json("there is no such loop in epoch " + std::to_string(epoch))};
  }
  return change(epoch, [&](store::ProjectWriter& writer) {
    return decide_on_loop(writer, options_.store, *stated, statement, {});
  });
}

ViewAnswer StoreView::undo(std::int64_t epoch) {
  return change(epoch, [](store::ProjectWriter& writer) { return *go_back(writer); });
}

}  // namespace unimapper::apps
