// Refinement of static and dynamic cells
#include "unimapper/merge/refinement.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <utility>
#include <vector>

#include "tests/merge/synthetic_sheets.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;

namespace {

PosedSession posed(const SessionData& session, std::size_t map = 0) {
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

const std::vector<Sheet> kWithout{kWall};
const std::vector<Sheet> kWith{kWall, kPerson};

/// What each keyframe of a session sees, all from one place.
SessionData seen(const std::vector<std::vector<Sheet>>& by_keyframe) {
  SessionData session;
  for (const std::vector<Sheet>& sheets : by_keyframe) {
    const auto sequence = static_cast<std::uint32_t>(session.keyframes.size());
    session.keyframes.push_back(keyframe_of(sequence, sheets));
  }
  return session;
}

std::vector<std::vector<Sheet>> times(std::size_t count, const std::vector<Sheet>& sheets) {
  return std::vector<std::vector<Sheet>>(count, sheets);
}

/// The keyframes of the second session are those of the first one's robot, later.
SessionData joined(SessionData first, const SessionData& second) {
  for (KeyframeRecord keyframe : second.keyframes) {
    keyframe.sequence = static_cast<std::uint32_t>(first.keyframes.size());
    first.keyframes.push_back(std::move(keyframe));
  }
  return first;
}

/// The session as if seen from `aside_m` aside.
PosedSession aside(const SessionData& session, double aside_m) {
  PosedSession result = posed(session);
  for (Pose& pose : result.T_map_keyframe) pose.translation.y() = aside_m;
  return result;
}

/// Share of the person's cells in a keyframe of the first session that are dynamic afterwards.
double share(const std::vector<PosedSession>& sessions, const RefinementConfig& config = {},
             std::size_t keyframe = 0) {
  return dynamic_share(sessions[0].session->keyframes[keyframe],
                       refine(sessions, config, 1)[0][keyframe], kPerson.x);
}
double share(const SessionData& session, const RefinementConfig& config = {},
             std::size_t keyframe = 0) {
  return share(std::vector<PosedSession>{posed(session)}, config, keyframe);
}

}  // namespace

TEST_CASE("a static object removed online by mistake is restored", "[refinement]") {
  SessionData session = seen(times(9, kWith));
  session.keyframes[4] = keyframe_of(4, {kWall}, {kPerson});
  CHECK(share(session, {}, 4) == 0.0);
}

TEST_CASE("a cell that no other keyframe observed keeps its online label", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall}, {kPerson}));
  CHECK(share(session) == 1.0);
}

TEST_CASE("without images the online labels stay", "[refinement]") {
  SessionData session = seen({kWith});
  for (std::uint32_t k = 1; k < 5; ++k) {
    session.keyframes.push_back(keyframe_of(k, {kWall}, {kPerson}));
  }
  for (KeyframeRecord& keyframe : session.keyframes) keyframe.images.clear();
  CHECK(share(session, {}, 0) == 0.0);
  CHECK(share(session, {}, 2) == 1.0);
}

TEST_CASE("another visit's free space removes a single observation but no object seen all day",
          "[refinement]") {
  const SessionData other_day = seen(times(8, kWithout));
  const SessionData ghost = seen({kWith});
  CHECK(share({posed(ghost), posed(other_day)}) == 1.0);
  // In a map of its own the other visit knows nothing of this one.
  CHECK(share({posed(ghost, 1), posed(other_day, 2)}) == 0.0);
  const SessionData parked = seen(times(6, kWith));
  CHECK(share({posed(parked), posed(other_day)}, {}, 2) == 0.0);
}

TEST_CASE("ground that was seen through as a whole is rejected", "[refinement]") {
  SessionData first = seen({kWith});
  for (FineCell& cell : first.keyframes[0].static_cells) {
    if (cell.position.x() < 8.0F) cell.ground = 1;
  }
  CHECK(share(joined(first, seen(times(4, kWithout)))) == 1.0);
  // Where it was not seen through, ground stays whatever else moves.
  CHECK(share(joined(first, seen(times(4, kWith)))) == 0.0);
}

TEST_CASE("ground is left out of the mean of what stands on it", "[refinement]") {
  // One row of cells above three that every keyframe observed; all others saw through that row. The
  // mean over two rows below is static: only as ground they do not count.
  const Sheet below{6.1F, -1.0F, 1.0F, -1.0F, -0.42F};
  const Sheet feet{6.1F, -1.0F, 1.0F, -0.38F, -0.22F};
  SessionData session = joined(seen({{kWall, feet, below}}), seen(times(4, {kWall, below})));
  const auto is_below = [](const FineCell& cell) {
    return cell.position.x() < 8.0F && cell.position.z() < -0.4F;
  };
  const auto dynamic_feet = [&](std::uint8_t ground) {
    for (FineCell& cell : session.keyframes[0].static_cells) {
      if (is_below(cell)) cell.ground = ground;
    }
    std::size_t dynamic = 0;
    visit_cells(session.keyframes[0], refine({posed(session)}, {}, 1)[0][0], true,
                [&](const FineCell& cell) {
                  CHECK_FALSE(is_below(cell));
                  ++dynamic;
                });
    return dynamic;
  };
  CHECK(dynamic_feet(0) == 0);
  CHECK(dynamic_feet(1) == cells_of(feet).size());
}

TEST_CASE("refinement does not depend on the number of threads, and can be turned off",
          "[refinement]") {
  std::vector<std::vector<Sheet>> sheets;
  for (int k = 0; k < 70; ++k) {
    const float y = 0.2F * static_cast<float>(k % 9);
    sheets.push_back({{12.1F, -1.0F, 1.0F, -1.0F, 1.0F}, {6.1F, y, y + 0.4F, -1.0F, 0.4F}});
  }
  const SessionData session = seen(sheets);
  const auto one = refine({posed(session)}, {}, 1);
  const auto three = refine({posed(session)}, {}, 3);
  REQUIRE(one[0].size() == 70);
  for (std::size_t k = 0; k < 70; ++k) CHECK(one[0][k].changed == three[0][k].changed);

  RefinementConfig off;
  off.window = 0;
  const auto unchanged = refine({posed(session)}, off, 1);
  for (const RefinedKeyframe& keyframe : unchanged[0]) CHECK(keyframe.changed.empty());
}

TEST_CASE("cells without a position keep their online label", "[refinement]") {
  SessionData session = seen(times(2, kWithout));
  session.keyframes[0].dynamic_cells = {{{1e30F, 0.0F, 0.0F}, 1, 0, 0},
                                        {{std::nanf(""), 0.0F, 0.0F}, 1, 0, 0}};
  const auto refined = refine({posed(session)}, {}, 1);
  std::size_t dynamic = 0;
  visit_cells(session.keyframes[0], refined[0][0], true, [&](const FineCell&) { ++dynamic; });
  CHECK(dynamic == 2);
}

TEST_CASE("the images of one keyframe together weigh no more than two", "[refinement]") {
  // Five keyframes observed the person, 0.425 each for the others' cells and 0.255 for every image:
  // 2.975 for static. A keyframe that saw through with six images says 2 x 0.85 for dynamic.
  const auto share_after = [](std::size_t seen_through) {
    SessionData later = seen(times(seen_through, kWithout));
    for (KeyframeRecord& keyframe : later.keyframes) {
      keyframe.images.resize(6, keyframe.images.front());
    }
    return share(joined(seen(times(5, kWith)), later), {}, 2);
  };
  CHECK(share_after(1) == 0.0);
  CHECK(share_after(2) > 0.8);
}

TEST_CASE("observers are the keyframes within the window and no others", "[refinement]") {
  RefinementConfig config;
  config.revisits = 0;
  config.window = 1;  // the first keyframe itself says -0.255: one other is enough
  CHECK(share(seen({kWith, kWithout, kWithout, kWithout}), config) == 1.0);
  const SessionData session = seen({kWith, kWith, kWithout, kWithout});
  CHECK(share(session, config) == 0.0);
  config.window = 2;  // one that saw through against one that observed the person: -0.935 + 0.85
  CHECK(share(session, config) == 0.0);
  config.window = 3;
  CHECK(share(session, config) == 1.0);
}

TEST_CASE("observations of different keyframes coincide in cells of the configured size",
          "[refinement]") {
  // Where the person was, one saw through, and three without images saw a person 35 cm farther off:
  // 0.85 - 0.255 for dynamic, and 1.275 for static if they coincide.
  Sheet farther = kPerson;
  farther.x += 0.35F;
  SessionData others = seen(times(3, {kWall, farther}));
  for (KeyframeRecord& keyframe : others.keyframes) keyframe.images.clear();
  const SessionData session = joined(seen({kWith, kWithout}), others);
  CHECK(share(session) > 0.9);
  RefinementConfig config;
  config.cell_size_m = 0.5F;
  CHECK(share(session, config) == 0.0);
}

TEST_CASE("keyframes of another visit are observers within their reach", "[refinement]") {
  const SessionData ghost = seen({kWith});
  const SessionData other_day = seen(times(8, kWithout));
  RefinementConfig config;
  config.reach_m = 0.51F;
  REQUIRE(config.revisits > 0);
  CHECK(share({posed(ghost), aside(other_day, 0.5)}, config) > 0.9);
  config.reach_m = 0.49F;
  CHECK(share({posed(ghost), aside(other_day, 0.5)}, config) == 0.0);
}

TEST_CASE("a component of which hardly anything moved is static as a whole", "[refinement]") {
  // A board of a hundred cells stands there in keyframes 0 to 2. In 3 to 6 only the part above
  // `cut_z` is left: what is below is seen through.
  const auto share_of_board = [](float cut_z) {
    const Sheet board{kPerson.x, -1.0F, 1.0F, -1.0F, 1.0F};
    const Sheet rest{kPerson.x, -1.0F, 1.0F, cut_z, 1.0F};
    return share(joined(seen(times(3, {kWall, board})), seen(times(4, {kWall, rest}))));
  };
  // Of ten rows the lowest one says "dynamic": too little.
  CHECK(share_of_board(-0.85F) == 0.0);
  // Of three rows the component becomes neither: cell by cell.
  const double some = share_of_board(-0.4F);
  CHECK(some > 0.1);
  CHECK(some < 0.6);
}

TEST_CASE("all revisits together weigh up to their limit and no more", "[refinement]") {
  // Every keyframe of the other visit saw through, 0.85 each, of which 1 counts. The first
  // keyframe's own image says -0.255.
  const SessionData other_day = seen(times(4, kWithout));
  SessionData parked = seen({kWith, kWith});
  // Cells and image of the second one: -0.935 in all.
  CHECK(share({posed(parked), posed(other_day)}) == 1.0);
  // The cells of two others: -1.105 in all.
  parked.keyframes.push_back(parked.keyframes[1]);
  for (const std::size_t k : {1U, 2U}) parked.keyframes[k].images.clear();
  CHECK(share({posed(parked), posed(other_day)}) == 0.0);
}

TEST_CASE("of more revisits than configured the nearest are used", "[refinement]") {
  const SessionData ghost = seen({kWith});
  const SessionData saw_through = seen({kWithout});
  const SessionData observed = seen(times(3, kWith));
  const auto share_with = [&](std::uint32_t revisits, double saw_through_m, double observed_m) {
    RefinementConfig config;
    config.revisits = revisits;
    return share({posed(ghost), aside(saw_through, saw_through_m), aside(observed, observed_m)},
                 config);
  };
  CHECK(share_with(1, 0.01, 0.02) == 1.0);
  CHECK(share_with(1, 0.02, 0.01) == 0.0);
  CHECK(share_with(4, 0.01, 0.02) == 0.0);  // three against one
  CHECK(share_with(0, 0.01, 0.02) == 0.0);
}

TEST_CASE("a revisit that observed a cell speaks against its having been seen through",
          "[refinement]") {
  const SessionData ghost = seen({kWith, {}});
  RefinementConfig config;
  config.window = 1;
  // One saw through, 0.85, against the first keyframe's own image, 0.255, and the cells of so many
  // revisits without images, 0.425 each.
  const auto shares = [&](std::size_t observed) {
    SessionData without_images = seen(times(observed, kWith));
    for (KeyframeRecord& keyframe : without_images.keyframes) keyframe.images.clear();
    const SessionData other_day = joined(seen({kWithout}), without_images);
    return std::pair(share({posed(ghost), posed(other_day)}, config),
                     share(joined(ghost, other_day), config));
  };
  CHECK(shares(1) == std::pair(1.0, 1.0));
  CHECK(shares(2) == std::pair(0.0, 0.0));
}

TEST_CASE("a person is removed where later keyframes saw through, also in a long session",
          "[refinement]") {
  std::vector<std::vector<Sheet>> sheets = times(130, kWithout);
  for (const std::size_t k : {9U, 69U, 129U}) sheets[k] = kWith;
  const SessionData session = seen(sheets);
  const auto refined = refine({posed(session)}, {}, 1);
  REQUIRE(refined[0].size() == 130);
  for (std::size_t k = 0; k < 130; ++k) {
    CHECK(dynamic_share(session.keyframes[k], refined[0][k], kWall.x) == 0.0);
    if (k % 60 != 9) continue;
    CHECK(dynamic_share(session.keyframes[k], refined[0][k], kPerson.x) == 1.0);
  }
}
