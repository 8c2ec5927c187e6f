// Surface materials: optical properties and semantic labels.
#pragma once

#include <cstdint>

namespace unimapper::simulator {

/// SemanticKITTI ids.
namespace label {
inline constexpr std::uint16_t kOfObject = 0;  ///< surface takes the label of its object
inline constexpr std::uint16_t kOutlier = 1;
inline constexpr std::uint16_t kCar = 10, kBicycle = 11, kBus = 13, kTruck = 18;
inline constexpr std::uint16_t kPerson = 30, kBicyclist = 31;
inline constexpr std::uint16_t kRoad = 40, kParking = 44, kSidewalk = 48, kOtherGround = 49;
inline constexpr std::uint16_t kBuilding = 50, kFence = 51;
inline constexpr std::uint16_t kLaneMarking = 60, kVegetation = 70, kTrunk = 71, kTerrain = 72;
inline constexpr std::uint16_t kPole = 80, kSign = 81, kOtherObject = 99;
/// Moving id of a movable class: 252 car, 253 bicyclist, 254 person, 257 bus, 258 truck.
std::uint16_t moving(std::uint16_t base);
}  // namespace label

enum class Surface : std::uint8_t {
  kRoad,
  kMarking,
  kKerb,
  kSidewalk,
  kLawn,
  kParkingLot,
  kPlaza,
  kBrick,
  kPlaster,
  kConcrete,
  kWindowFrame,
  kGlass,
  kInterior,
  kDoor,
  kRoof,
  kRail,
  kWoodFence,
  kStoneWall,
  kLeaf,
  kHedgeCore,
  kBark,
  kPoleMetal,
  kPoleWood,
  kWire,
  kSign,
  kSignBack,
  kLampHead,
  kBin,
  kCabinet,
  kBench,
  kPaintLight,
  kPaintMid,
  kPaintDark,
  kCarGlass,
  kTyre,
  kCarTrim,
  kPlate,
  kHeadlight,
  kClothLight,
  kClothDark,
  kSkin,
  kBikeFrame,
  kCount
};

/// Optical properties at 905 nm.
struct SurfaceProperties {
  std::uint16_t label;
  float reflectance;        ///< diffuse, 0..1
  float lobe_exponent;      ///< of the cosine of incidence
  float specular;           ///< weight of a narrow lobe around the normal (car paint)
  bool is_glass;            ///< lets most of the beam through
  bool is_retroreflective;  ///< about twenty times the return of a white wall
};

const SurfaceProperties& properties(Surface surface);

}  // namespace unimapper::simulator
