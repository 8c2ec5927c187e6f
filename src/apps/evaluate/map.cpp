// `unimapper evaluate map`: agreement of merged sessions.
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/evaluate/ply_cloud.hpp"

namespace unimapper::apps {

std::string evaluate_map(const EvaluateMapOptions& options) {
  std::vector<std::string> names;
  std::vector<std::vector<Eigen::Vector3f>> clouds;
  std::vector<Eigen::Vector3f> together;
  for (const SummarySession& session : read_summary(options.map)) {
    if (session.status == "unconnected") continue;
    names.push_back(session.name);
    clouds.push_back(read_ply_positions(options.map / "clouds" / (session.name + ".ply")));
    together.insert(together.end(), clouds.back().begin(), clouds.back().end());
  }
  if (names.empty()) throw std::runtime_error(options.map.string() + ": holds no merged session");
  std::vector<SessionPair> pairs;
  for (std::size_t a = 0; a < names.size(); ++a) {
    for (std::size_t b = a + 1; b < names.size(); ++b) {
      pairs.push_back(
          {names[a], names[b], evaluate::compare_clouds(clouds[a], clouds[b], options.tau_m)});
    }
  }
  evaluate::EntropyConfig config;
  config.radius_m = options.mme_radius_m;
  config.min_neighbours = options.mme_min_neighbours;
  return map_json(options, pairs, evaluate::map_entropy(together, config), together.size());
}

}  // namespace unimapper::apps
