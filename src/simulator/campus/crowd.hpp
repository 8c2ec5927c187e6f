// Crowd simulation of the campus: pedestrians, cyclists and delivery vans.
#pragma once

#include "robot_walk.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::campus {

/// Persons who walk with the robot, queue, stand together, stroll over the plaza and along the
/// paths alone or in groups; cyclists and delivery vans. Everybody gives way to the robot.
ActorSet simulate_crowd(const Plan& plan, const RobotWalk& robot, std::uint64_t seed,
                        std::uint32_t day, double duration_s);

/// The first `kCompanions` actors of a crowd stay one to two metres beside and behind the robot;
/// the next one, the guide, walks 5 m ahead.
inline constexpr std::size_t kCompanions = 2;

// Contributions of the single files; `simulate_crowd` calls them in order.
void add_companions(const RobotWalk& robot, std::size_t ticks, Random& random, ActorSet& crowd);
void add_queue(const Plan& plan, std::size_t ticks, Random& random, ActorSet& crowd);
void add_gatherings(const Plan& plan, std::size_t ticks, Random& random, ActorSet& crowd);
/// They walk around all actors that are in `crowd` already.
void add_strollers(const Plan& plan, const RobotWalk& robot, std::size_t ticks, Random& random,
                   ActorSet& crowd);

/// True if a disc lies on the plaza and touches neither a fixture nor the queue.
bool is_clear_on_plaza(const Plan& plan, Vec2 at, double radius);

}  // namespace unimapper::simulator::campus
