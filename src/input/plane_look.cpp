// A first look at two scans: points of one on planes of the other
#include "src/input/plane_look.hpp"

#include <memory>

#include "unimapper/core/arena.hpp"

namespace unimapper::input {

PlaneLook::PlaneLook() {
  Arena measuring = Arena::measuring();
  planes_.allocate(measuring);
  std::size_t room = measuring.used() + Arena::kAlignment;
  memory_.resize(room);
  void* begin = memory_.data();
  std::align(Arena::kAlignment, measuring.used(), begin, room);
  Arena arena(static_cast<std::byte*>(begin), room);
  planes_.allocate(arena);
}

onboard::PlaneFit PlaneLook::fit(std::span<const Eigen::Vector3f> first,
                                 std::span<const Eigen::Vector3f> second,
                                 const Pose& T_first_second) {
  planes_.clear();
  for (const Eigen::Vector3f& point : first) planes_.add(point);
  planes_.fit();
  looked_at_.clear();
  for (std::size_t i = 0; i < second.size(); i += 2) looked_at_.push_back(second[i]);
  return onboard::fit_of(planes_, looked_at_, T_first_second);
}

}  // namespace unimapper::input
