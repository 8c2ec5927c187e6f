#include "src/apps/evaluate/shown_map.hpp"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "src/apps/view/map_files.hpp"

namespace unimapper::apps {
namespace {

ShownSession shown_session(const nlohmann::json& json) {
  ShownSession session;
  json.at("name").get_to(session.name);
  json.at("sequences").get_to(session.sequences);
  const auto offsets_s = json.at("stamps_s").get<std::vector<double>>();
  const auto poses = json.at("poses").get<std::vector<std::vector<double>>>();
  if (poses.size() != session.sequences.size() || offsets_s.size() != poses.size()) {
    throw std::runtime_error("session \"" + session.name +
                             "\" has not one stamp and pose a keyframe");
  }
  const double start_s = poses.empty() ? 0.0 : json.at("start_s").get<double>();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double stamp_s = start_s + offsets_s[k];
    // Stamps of a clock: 10 digits before the point.
    if (!(std::abs(stamp_s) < 9e9)) throw std::runtime_error("a stamp is out of range");
    session.stamps_ns.push_back(std::llround(1e9 * stamp_s));
    session.positions.emplace_back(poses[k].at(0), poses[k].at(1), poses[k].at(2));
  }
  return session;
}

}  // namespace

std::vector<ShownSession> read_shown_map(const std::filesystem::path& map) {
  const std::filesystem::path file = map / kViewFolder / "map.json";
  std::ifstream in(file);
  if (!in) {
    throw std::runtime_error(
        file.string() + ": no such file; `unimapper merge` and `unimapper map export` write it");
  }
  std::vector<ShownSession> sessions;
  try {
    const nlohmann::json json = nlohmann::json::parse(in);
    for (const auto& session : json.at("sessions")) sessions.push_back(shown_session(session));
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what() +
                             "; write the map anew if it is of an older version");
  }
  return sessions;
}

}  // namespace unimapper::apps
