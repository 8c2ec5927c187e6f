#include "src/apps/map/site_system.hpp"

#include <algorithm>
#include <iostream>

#include "ports/store/project_writer.hpp"

namespace unimapper::apps {

void warn_of_place(const Projection& system, const std::vector<store::StoredPosition>& positions) {
  const auto found = std::find_if(positions.begin(), positions.end(),
                                  [](const auto& position) { return position.sigma_xy_m; });
  if (found == positions.end()) return;
  const std::string doubt = system.doubt(found->position);
  if (!doubt.empty()) std::cerr << "unimapper: warning: " << doubt << '\n';
}

std::optional<store::Epoch> state_system(const std::filesystem::path& store,
                                         const std::string& name) {
  const Projection system(name);
  store::ProjectWriter writer(store, "`unimapper map crs`");
  return writer.commit("crs " + name, [&](store::ProjectState& state) {
    const bool has_positions =
        std::any_of(state.statements.begin(), state.statements.end(),
                    [](const auto& said) { return !said.positions.empty(); });
    if (has_positions && !state.crs.empty() && state.crs != name) {
      std::cerr << "unimapper: warning: positions stay in metres of " << state.crs
                << ", also those that were given as latitude and longitude: give these anew\n";
    }
    state.crs = name;
    for (const store::StoredStatement& said : state.statements) {
      warn_of_place(system, said.positions);
    }
    return std::optional("coordinate system " + name);
  });
}

}  // namespace unimapper::apps
