#include "src/apps/map/stored_map.hpp"

#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "ports/store/store_reader.hpp"
#include "src/apps/map/stored_result.hpp"
#include "unimapper/config/config_json.hpp"

namespace unimapper::apps {

StoredMap read_stored_map(const std::filesystem::path& store, std::int64_t epoch,
                          StoredContents* contents, SessionOrder order) {
  store::StoreReader reader(store);
  store::ProjectReader project = reader.project();
  const store::ProjectState state = epoch > 0 ? project.at(epoch) : project.current();
  if (state.epoch.result == 0) {
    throw std::runtime_error(store.string() + ": there is no map in epoch " +
                             std::to_string(state.epoch.number) +
                             "; `unimapper map merge` makes one");
  }
  const store::MapResult stored = project.result(state.epoch.result);
  std::vector<std::int64_t> merged;
  std::map<std::int64_t, std::set<std::uint32_t>> keyframes;
  for (const store::SessionResult& session : stored.sessions) {
    merged.push_back(session.session);
    keyframes[session.session].insert(session.sequences.begin(), session.sequences.end());
  }
  StoredMap map;
  map.epoch = state.epoch.number;
  map.crs = state.crs;
  std::vector<InputSession> inputs = read_sessions(store, merged, keyframes, contents, order);
  for (const InputSession& input : inputs) map.rows.push_back(input.row);
  map.sessions = data_of(inputs);
  map.posed = posed_result(stored, KeyframeRows(inputs, map.sessions));
  parse_config(stored.parameters, store.string(), map.config);
  return map;
}

}  // namespace unimapper::apps
