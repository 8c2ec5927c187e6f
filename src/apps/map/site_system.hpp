// The coordinate system of a stored project's site.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ports/store/project.hpp"
#include "src/apps/map/projection.hpp"

namespace unimapper::apps {

/// States that positions of the project in `store` are in the system `name`; nothing if that is
/// stated already. Warnings go to stderr. Throws std::runtime_error with the remedy.
std::optional<store::Epoch> state_system(const std::filesystem::path& store,
                                         const std::string& name);

/// Says on stderr if a position is not where the system is used.
void warn_of_place(const Projection& system, const std::vector<store::StoredPosition>& positions);

}  // namespace unimapper::apps
