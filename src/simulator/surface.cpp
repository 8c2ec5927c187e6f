#include "surface.hpp"

#include <array>

namespace unimapper::simulator {
namespace {

using S = SurfaceProperties;
constexpr std::array<S, static_cast<std::size_t>(Surface::kCount)> kTable{{
    S{label::kRoad, 0.14F, 0.85F, 0, false, false},         // road
    S{label::kLaneMarking, 0.45F, 0.85F, 0, false, false},  // marking
    S{label::kSidewalk, 0.28F, 1, 0, false, false},         // kerb
    S{label::kSidewalk, 0.26F, 0.9F, 0, false, false},      // sidewalk
    S{label::kTerrain, 0.42F, 0.8F, 0, false, false},       // lawn
    S{label::kParking, 0.16F, 0.85F, 0, false, false},      // parking lot
    S{label::kOtherGround, 0.3F, 0.9F, 0, false, false},    // plaza
    S{label::kBuilding, 0.35F, 1, 0, false, false},         // brick
    S{label::kBuilding, 0.62F, 1, 0, false, false},         // plaster
    S{label::kBuilding, 0.4F, 1, 0, false, false},          // concrete
    S{label::kBuilding, 0.55F, 1, 0, false, false},         // window frame
    S{label::kBuilding, 0.25F, 1, 0, true, false},          // glass
    S{label::kBuilding, 0.35F, 1, 0, false, false},         // interior
    S{label::kBuilding, 0.28F, 1, 0, false, false},         // door
    S{label::kBuilding, 0.22F, 1, 0, false, false},         // roof
    S{label::kBuilding, 0.35F, 1, 0.2F, false, false},      // balcony rail
    S{label::kFence, 0.38F, 1, 0, false, false},            // wooden fence
    S{label::kFence, 0.36F, 1, 0, false, false},            // garden wall
    S{label::kVegetation, 0.45F, 0.7F, 0, false, false},    // leaf
    S{label::kVegetation, 0.2F, 0.7F, 0, false, false},     // inside of a hedge
    S{label::kTrunk, 0.3F, 1, 0, false, false},             // bark
    S{label::kPole, 0.35F, 1, 0.2F, false, false},          // metal pole
    S{label::kPole, 0.28F, 1, 0, false, false},             // wooden pole
    S{label::kOtherObject, 0.15F, 1, 0, false, false},      // wire
    S{label::kSign, 0.6F, 0.4F, 0, false, true},            // sign
    S{label::kSign, 0.4F, 1, 0.2F, false, false},           // back of a sign
    S{label::kPole, 0.4F, 1, 0.1F, false, false},           // lamp head
    S{label::kOtherObject, 0.25F, 1, 0, false, false},      // bin
    S{label::kOtherObject, 0.4F, 1, 0, false, false},       // cabinet
    S{label::kOtherObject, 0.3F, 1, 0, false, false},       // bench
    S{label::kOfObject, 0.6F, 1.6F, 0.6F, false, false},    // light paint
    S{label::kOfObject, 0.25F, 1.6F, 0.6F, false, false},   // medium paint
    S{label::kOfObject, 0.05F, 1.6F, 0.6F, false, false},   // dark paint
    S{label::kOfObject, 0.2F, 1, 0, true, false},           // car glass
    S{label::kOfObject, 0.06F, 1, 0, false, false},         // tyre
    S{label::kOfObject, 0.12F, 1, 0, false, false},         // trim, seats
    S{label::kOfObject, 0.6F, 0.4F, 0, false, true},        // number plate
    S{label::kOfObject, 0.6F, 0.6F, 0.2F, false, false},    // headlight
    S{label::kOfObject, 0.55F, 0.9F, 0, false, false},      // light clothes
    S{label::kOfObject, 0.2F, 0.9F, 0, false, false},       // dark clothes
    S{label::kOfObject, 0.5F, 0.9F, 0, false, false},       // skin
    S{label::kOfObject, 0.3F, 1, 0.2F, false, false},       // bicycle frame
}};

}  // namespace

const SurfaceProperties& properties(Surface surface) {
  return kTable[static_cast<std::size_t>(surface)];
}

std::uint16_t label::moving(std::uint16_t base) {
  switch (base) {
    case kCar:
      return 252;
    case kBicyclist:
      return 253;
    case kPerson:
      return 254;
    case kBus:
      return 257;
    case kTruck:
      return 258;
    default:
      return base;
  }
}

}  // namespace unimapper::simulator
