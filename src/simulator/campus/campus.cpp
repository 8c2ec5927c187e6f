#include "campus.hpp"

namespace unimapper::simulator::campus {

void add_instance(Campus& campus, PrototypeRange range, std::uint32_t variant, Vec2 at, double turn,
                  double scale, std::uint16_t label, std::uint16_t object) {
  const Frame frame = upright_frame(campus.plan.ground(at), {std::cos(turn), std::sin(turn)});
  campus.instances.push_back({range.first + variant % range.count, frame, scale, label, object});
}

Campus build_campus(std::uint64_t seed, std::uint32_t day) {
  Campus campus(seed);
  build_prototypes(seed, campus.prototypes);
  add_grounds(seed, campus);
  add_terrace(campus);
  add_halls(seed, campus);
  add_plaza(seed, day, campus);
  add_greenery(seed, campus);
  add_path_furniture(seed, day, campus);
  add_bicycles_and_cars(seed, day, campus);
  return campus;
}

}  // namespace unimapper::simulator::campus
