// What is static, decided again with hindsight.
#include "unimapper/merge/refinement.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <map>

#include "unimapper/core/image_code.hpp"
#include "unimapper/core/voxel_key.hpp"

using namespace unimapper;
using namespace unimapper::merge;

namespace {

/// An upright rectangle across the robot's view, as points a few centimetres apart.
struct Sheet {
  float x;
  float y_min, y_max;
  float z_min, z_max;

  [[nodiscard]] std::vector<Eigen::Vector3f> points() const {
    std::vector<Eigen::Vector3f> points;
    for (float y = y_min; y <= y_max; y += 0.04F) {
      for (float z = z_min; z <= z_max; z += 0.04F) points.emplace_back(x, y, z);
    }
    return points;
  }
};

const Sheet kWall{12.1F, -6.0F, 6.0F, -2.0F, 3.0F};
const Sheet kPerson{6.1F, -0.3F, 0.3F, -1.2F, 0.6F};

std::vector<FineCell> cells_of(const Sheet& sheet) {
  std::map<std::array<int, 3>, std::pair<Eigen::Vector3f, int>> sums;
  for (const Eigen::Vector3f& p : sheet.points()) {
    const VoxelIndex at = voxel_index(p, 5.0F);
    auto& [sum, count] =
        sums.try_emplace({at.x, at.y, at.z}, Eigen::Vector3f::Zero(), 0).first->second;
    sum += p;
    ++count;
  }
  std::vector<FineCell> cells;
  for (const auto& [at, entry] : sums) {
    cells.push_back({entry.first / static_cast<float>(entry.second),
                     static_cast<std::uint16_t>(entry.second), 0, 0});
  }
  return cells;
}

/// How far one sees from the origin if there is nothing but `sheets`.
std::vector<std::uint8_t> image_of(const RangeImageShape& shape, const std::vector<Sheet>& sheets) {
  const ImageProjection projection(shape);
  std::vector<std::uint16_t> pixels(projection.pixels(), 0);
  for (const Sheet& sheet : sheets) {
    for (const Eigen::Vector3f& p : sheet.points()) {
      std::int32_t pixel = 0;
      float range_m = 0.0F;
      projection.project(&p.x(), &p.y(), &p.z(), 1, &pixel, &range_m);
      if (pixel == ImageProjection::kOutside) continue;
      auto& nearest = pixels[static_cast<std::size_t>(pixel)];
      const auto units = static_cast<std::uint16_t>(range_m * kRangeUnitsPerMetre);
      nearest = nearest == 0 ? units : std::min(nearest, units);
    }
  }
  std::vector<std::uint8_t> code(max_image_code(pixels.size()));
  code.resize(encode_image(pixels, code));
  return code;
}

/// What a robot that stands at the origin makes of `kept` and `removed`.
KeyframeRecord keyframe_of(std::uint32_t sequence, const std::vector<Sheet>& kept,
                           const std::vector<Sheet>& removed = {}) {
  KeyframeRecord keyframe;
  keyframe.sequence = sequence;
  keyframe.scans.resize(1);
  keyframe.image_shape = {120.0F, 1.0F, -40.0F, 40.0F, 1.0F};
  std::vector<Sheet> all = kept;
  all.insert(all.end(), removed.begin(), removed.end());
  keyframe.images = {{0, image_of(keyframe.image_shape, all)}};
  for (const Sheet& sheet : kept) {
    for (const FineCell& cell : cells_of(sheet)) keyframe.static_cells.push_back(cell);
  }
  for (const Sheet& sheet : removed) {
    for (const FineCell& cell : cells_of(sheet)) keyframe.dynamic_cells.push_back(cell);
  }
  return keyframe;
}

PlacedSession placed(const SessionData& session, std::size_t map = 0) {
  return {&session, std::vector<Pose>(session.keyframes.size()), map};
}

/// Share of a keyframe's cells at distance `x` that are dynamic after refinement.
double dynamic_share(const KeyframeRecord& keyframe, const RefinedKeyframe& refined, float x) {
  std::size_t all = 0;
  std::size_t dynamic = 0;
  for (const bool is_dynamic : {false, true}) {
    visit_cells(keyframe, refined, is_dynamic, [&](const FineCell& cell) {
      if (std::abs(cell.position.x() - x) > 0.15F) return;
      ++all;
      dynamic += is_dynamic ? 1 : 0;
    });
  }
  REQUIRE(all > 0);
  return static_cast<double>(dynamic) / static_cast<double>(all);
}

}  // namespace

TEST_CASE("who had not moved when the robot decided is removed by those who saw the place empty",
          "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes.push_back(keyframe_of(k, {kWall}));
  const auto refined = refine({placed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 1.0);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(dynamic_share(session.keyframes[k], refined[0][k], kWall.x) == 0.0);
  }
}

TEST_CASE("what was removed by mistake and stands there all the time comes back", "[refinement]") {
  SessionData session;
  for (std::uint32_t k = 0; k < 9; ++k)
    session.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  session.keyframes[4] = keyframe_of(4, {kWall}, {kPerson});
  const auto refined = refine({placed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[4], refined[0][4], kPerson.x) == 0.0);
}

TEST_CASE("what the robot alone knows stays as it said", "[refinement]") {
  // Nobody else saw the place: it was out of everybody's view.
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall}, {kPerson}));
  CHECK(dynamic_share(session.keyframes[0], refine({placed(session)}, {}, 1)[0][0], kPerson.x) ==
        1.0);
}

TEST_CASE("a robot that sends no images is believed", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (std::uint32_t k = 1; k < 5; ++k)
    session.keyframes.push_back(keyframe_of(k, {kWall}, {kPerson}));
  for (KeyframeRecord& keyframe : session.keyframes) keyframe.images.clear();
  const auto refined = refine({placed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 0.0);
  CHECK(dynamic_share(session.keyframes[2], refined[0][2], kPerson.x) == 1.0);
}

TEST_CASE("what another visit saw removes a ghost but not what stood here all day",
          "[refinement]") {
  SessionData other_day;
  for (std::uint32_t k = 0; k < 8; ++k) other_day.keyframes.push_back(keyframe_of(k, {kWall}));

  SessionData ghost;
  ghost.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  const auto with_ghost = refine({placed(ghost), placed(other_day)}, {}, 1);
  CHECK(dynamic_share(ghost.keyframes[0], with_ghost[0][0], kPerson.x) == 1.0);
  // In a map of its own the other visit knows nothing of this one.
  const auto apart = refine({placed(ghost, 1), placed(other_day, 2)}, {}, 1);
  CHECK(dynamic_share(ghost.keyframes[0], apart[0][0], kPerson.x) == 0.0);

  SessionData parked;
  for (std::uint32_t k = 0; k < 6; ++k)
    parked.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  const auto with_parked = refine({placed(parked), placed(other_day)}, {}, 1);
  CHECK(dynamic_share(parked.keyframes[2], with_parked[0][2], kPerson.x) == 0.0);
}

TEST_CASE("ground that was seen through as a whole was none", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (FineCell& cell : session.keyframes[0].static_cells) {
    if (cell.position.x() < 8.0F) cell.ground = 1;
  }
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes.push_back(keyframe_of(k, {kWall}));
  const auto refined = refine({placed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 1.0);

  // Where it was not seen through, ground stays whatever else moves.
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes[k] = keyframe_of(k, {kWall, kPerson});
  CHECK(dynamic_share(session.keyframes[0], refine({placed(session)}, {}, 1)[0][0], kPerson.x) ==
        0.0);
}

TEST_CASE("refinement does not depend on the number of threads, and can be turned off",
          "[refinement]") {
  SessionData session;
  for (std::uint32_t k = 0; k < 70; ++k) {
    const float y = 0.2F * static_cast<float>(k % 9);
    session.keyframes.push_back(
        keyframe_of(k, {{12.1F, -1.0F, 1.0F, -1.0F, 1.0F}, {6.1F, y, y + 0.4F, -1.0F, 0.4F}}));
  }
  const auto one = refine({placed(session)}, {}, 1);
  const auto three = refine({placed(session)}, {}, 3);
  REQUIRE(one[0].size() == 70);
  for (std::size_t k = 0; k < 70; ++k) CHECK(one[0][k].dynamic == three[0][k].dynamic);

  RefinementConfig off;
  off.window = 0;
  const auto unchanged = refine({placed(session)}, off, 1);
  for (const RefinedKeyframe& keyframe : unchanged[0]) {
    CHECK(std::count(keyframe.dynamic.begin(), keyframe.dynamic.end(), 1) == 0);
  }
}

TEST_CASE("cells that lie nowhere keep the robot's verdict", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall}));
  session.keyframes[0].dynamic_cells.push_back({{1e30F, 0.0F, 0.0F}, 1, 0, 0});
  session.keyframes[0].dynamic_cells.push_back({{std::nanf(""), 0.0F, 0.0F}, 1, 0, 0});
  session.keyframes.push_back(keyframe_of(1, {kWall}));
  const auto refined = refine({placed(session)}, {}, 1);
  const std::size_t kept = session.keyframes[0].static_cells.size();
  CHECK(refined[0][0].dynamic.at(kept) == 1);
  CHECK(refined[0][0].dynamic.at(kept + 1) == 1);
}
