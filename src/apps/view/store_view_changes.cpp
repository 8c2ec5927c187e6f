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

ViewAnswer StoreView::decide(std::size_t loop, LoopStatement statement, std::int64_t epoch) {
  StatedLoop stated;
  {
    const std::lock_guard lock(mutex_);
    if (shown_.epoch != epoch || loop >= shown_.merged.loops.size()) {
      return {409, error_in_json("there is no such loop in epoch " + std::to_string(epoch))};
    }
    const merge::LoopConstraint& chosen = shown_.merged.loops[loop];
    const auto keyframe = [&](KeyframeId k) -> const KeyframeRecord& {
      return shown_.sessions[k.session].keyframes[k.keyframe];
    };
    const KeyframeRows rows(shown_.rows, shown_.sessions);
    stated.query = rows.row(chosen.query);
    stated.match = rows.row(chosen.match);
    stated.T_match_query = merge::reference_sensor_pose(keyframe(chosen.match)).inverse() *
                           chosen.T_match_query *
                           merge::reference_sensor_pose(keyframe(chosen.query));
  }
  return change(epoch, [&](store::ProjectWriter& writer) {
    return decide_on_loop(writer, options_.store, stated, statement, {});
  });
}

ViewAnswer StoreView::undo(std::int64_t epoch) {
  return change(epoch, [](store::ProjectWriter& writer) { return *go_back(writer); });
}

}  // namespace unimapper::apps
