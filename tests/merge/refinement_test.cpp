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

}  // namespace

TEST_CASE("a person that moves off later is removed where later keyframes saw through",
          "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes.push_back(keyframe_of(k, {kWall}));
  const auto refined = refine({posed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 1.0);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(dynamic_share(session.keyframes[k], refined[0][k], kWall.x) == 0.0);
  }
}

TEST_CASE("a static object removed online by mistake is restored", "[refinement]") {
  SessionData session;
  for (std::uint32_t k = 0; k < 9; ++k)
    session.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  session.keyframes[4] = keyframe_of(4, {kWall}, {kPerson});
  const auto refined = refine({posed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[4], refined[0][4], kPerson.x) == 0.0);
}

TEST_CASE("a cell that no other keyframe observed keeps its online label", "[refinement]") {
  // No other keyframe observed it.
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall}, {kPerson}));
  CHECK(dynamic_share(session.keyframes[0], refine({posed(session)}, {}, 1)[0][0], kPerson.x) ==
        1.0);
}

TEST_CASE("without images the online labels stay", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (std::uint32_t k = 1; k < 5; ++k)
    session.keyframes.push_back(keyframe_of(k, {kWall}, {kPerson}));
  for (KeyframeRecord& keyframe : session.keyframes) keyframe.images.clear();
  const auto refined = refine({posed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 0.0);
  CHECK(dynamic_share(session.keyframes[2], refined[0][2], kPerson.x) == 1.0);
}

TEST_CASE("another visit's free space removes a single observation but no object seen all day",
          "[refinement]") {
  SessionData other_day;
  for (std::uint32_t k = 0; k < 8; ++k) other_day.keyframes.push_back(keyframe_of(k, {kWall}));

  SessionData ghost;
  ghost.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  const auto with_ghost = refine({posed(ghost), posed(other_day)}, {}, 1);
  CHECK(dynamic_share(ghost.keyframes[0], with_ghost[0][0], kPerson.x) == 1.0);
  // In a map of its own the other visit knows nothing of this one.
  const auto apart = refine({posed(ghost, 1), posed(other_day, 2)}, {}, 1);
  CHECK(dynamic_share(ghost.keyframes[0], apart[0][0], kPerson.x) == 0.0);

  SessionData parked;
  for (std::uint32_t k = 0; k < 6; ++k)
    parked.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  const auto with_parked = refine({posed(parked), posed(other_day)}, {}, 1);
  CHECK(dynamic_share(parked.keyframes[2], with_parked[0][2], kPerson.x) == 0.0);
}

TEST_CASE("ground that was seen through as a whole is rejected", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (FineCell& cell : session.keyframes[0].static_cells) {
    if (cell.position.x() < 8.0F) cell.ground = 1;
  }
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes.push_back(keyframe_of(k, {kWall}));
  const auto refined = refine({posed(session)}, {}, 1);
  CHECK(dynamic_share(session.keyframes[0], refined[0][0], kPerson.x) == 1.0);

  // Where it was not seen through, ground stays whatever else moves.
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes[k] = keyframe_of(k, {kWall, kPerson});
  CHECK(dynamic_share(session.keyframes[0], refine({posed(session)}, {}, 1)[0][0], kPerson.x) ==
        0.0);
}

TEST_CASE("ground is left out of the mean of what stands on it", "[refinement]") {
  // One row of cells above three that every keyframe observed; all others saw through that row. The
  // mean over two rows below is static: only as ground they do not count.
  const Sheet below{6.1F, -1.0F, 1.0F, -1.0F, -0.42F};
  const Sheet feet{6.1F, -1.0F, 1.0F, -0.38F, -0.22F};
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, feet, below}));
  for (std::uint32_t k = 1; k < 5; ++k) session.keyframes.push_back(keyframe_of(k, {kWall, below}));
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
  SessionData session;
  for (std::uint32_t k = 0; k < 70; ++k) {
    const float y = 0.2F * static_cast<float>(k % 9);
    session.keyframes.push_back(
        keyframe_of(k, {{12.1F, -1.0F, 1.0F, -1.0F, 1.0F}, {6.1F, y, y + 0.4F, -1.0F, 0.4F}}));
  }
  const auto one = refine({posed(session)}, {}, 1);
  const auto three = refine({posed(session)}, {}, 3);
  REQUIRE(one[0].size() == 70);
  for (std::size_t k = 0; k < 70; ++k) CHECK(one[0][k].changed == three[0][k].changed);

  RefinementConfig off;
  off.window = 0;
  const auto unchanged = refine({posed(session)}, off, 1);
  for (const RefinedKeyframe& keyframe : unchanged[0]) {
    CHECK(keyframe.changed.empty());
  }
}

TEST_CASE("cells without a position keep their online label", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall}));
  session.keyframes[0].dynamic_cells.push_back({{1e30F, 0.0F, 0.0F}, 1, 0, 0});
  session.keyframes[0].dynamic_cells.push_back({{std::nanf(""), 0.0F, 0.0F}, 1, 0, 0});
  session.keyframes.push_back(keyframe_of(1, {kWall}));
  const auto refined = refine({posed(session)}, {}, 1);
  std::size_t dynamic = 0;
  visit_cells(session.keyframes[0], refined[0][0], true, [&](const FineCell&) { ++dynamic; });
  CHECK(dynamic == 2);
}

TEST_CASE("the images of one keyframe together weigh no more than two", "[refinement]") {
  // Five keyframes observed the person, 0.425 each for the others' cells and 0.255 for every image:
  // 2.975 for static. A keyframe that saw through with six images says 2 x 0.85 for dynamic.
  const auto share_after = [](std::uint32_t seen_through) {
    SessionData session;
    for (std::uint32_t k = 0; k < 5; ++k) {
      session.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
    }
    for (std::uint32_t k = 0; k < seen_through; ++k) {
      KeyframeRecord keyframe = keyframe_of(5 + k, {kWall});
      keyframe.images.resize(6, keyframe.images.front());
      session.keyframes.push_back(keyframe);
    }
    return dynamic_share(session.keyframes[2], refine({posed(session)}, {}, 1)[0][2], kPerson.x);
  };
  CHECK(share_after(1) == 0.0);
  CHECK(share_after(2) > 0.8);
}

TEST_CASE("observers are the keyframes within the window and no others", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  for (std::uint32_t k = 1; k < 4; ++k) session.keyframes.push_back(keyframe_of(k, {kWall}));
  RefinementConfig config;
  config.revisits = 0;
  config.window = 1;  // the first keyframe itself says -0.255: one other is enough
  const auto share = [&] {
    return dynamic_share(session.keyframes[0], refine({posed(session)}, config, 1)[0][0],
                         kPerson.x);
  };
  CHECK(share() == 1.0);
  session.keyframes[1] = keyframe_of(1, {kWall, kPerson});
  CHECK(share() == 0.0);
  config.window = 2;  // one that saw through against one that observed the person: -0.935 + 0.85
  CHECK(share() == 0.0);
  config.window = 3;
  CHECK(share() == 1.0);
}

TEST_CASE("observations of different keyframes coincide in cells of the configured size",
          "[refinement]") {
  // Where the person was, one saw through, and three without images saw a person 35 cm farther off:
  // 0.85 - 0.255 for dynamic, and 1.275 for static if they coincide.
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  session.keyframes.push_back(keyframe_of(1, {kWall}));
  Sheet farther = kPerson;
  farther.x += 0.35F;
  for (std::uint32_t k = 2; k < 5; ++k) {
    session.keyframes.push_back(keyframe_of(k, {kWall, farther}));
    session.keyframes.back().images.clear();
  }
  RefinementConfig config;
  const auto share = [&] {
    return dynamic_share(session.keyframes[0], refine({posed(session)}, config, 1)[0][0],
                         kPerson.x);
  };
  CHECK(share() > 0.9);
  config.cell_size_m = 0.5F;
  CHECK(share() == 0.0);
}

TEST_CASE("keyframes of another visit are observers within their reach", "[refinement]") {
  SessionData ghost;
  ghost.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  SessionData other_day;
  for (std::uint32_t k = 0; k < 8; ++k) other_day.keyframes.push_back(keyframe_of(k, {kWall}));
  // The whole visit is known as if taken from half a metre aside.
  PosedSession visit = posed(other_day);
  for (Pose& pose : visit.T_map_keyframe) pose.translation.y() = 0.5;
  RefinementConfig config;
  config.reach_m = 0.51F;
  REQUIRE(config.revisits > 0);
  CHECK(dynamic_share(ghost.keyframes[0], refine({posed(ghost), visit}, config, 1)[0][0],
                      kPerson.x) > 0.9);
  config.reach_m = 0.49F;
  CHECK(dynamic_share(ghost.keyframes[0], refine({posed(ghost), visit}, config, 1)[0][0],
                      kPerson.x) == 0.0);
}

namespace {

/// A board of a hundred cells stands there in keyframes 0 to 2. In 3 to 6 only the part above
/// `cut_z` is left: what is below is seen through.
double share_of_board(float cut_z) {
  const Sheet board{6.1F, -1.0F, 1.0F, -1.0F, 1.0F};
  const Sheet rest{6.1F, -1.0F, 1.0F, cut_z, 1.0F};
  SessionData session;
  for (std::uint32_t k = 0; k < 7; ++k) {
    session.keyframes.push_back(keyframe_of(k, {kWall, k < 3 ? board : rest}));
  }
  return dynamic_share(session.keyframes[0], refine({posed(session)}, {}, 1)[0][0], board.x);
}

}  // namespace

TEST_CASE("a component of which hardly anything moved is static as a whole", "[refinement]") {
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
  SessionData other_day;
  for (std::uint32_t k = 0; k < 4; ++k) other_day.keyframes.push_back(keyframe_of(k, {kWall}));
  SessionData parked;
  for (std::uint32_t k = 0; k < 2; ++k) {
    parked.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  }
  const auto share = [&] {
    return dynamic_share(parked.keyframes[0],
                         refine({posed(parked), posed(other_day)}, {}, 1)[0][0], kPerson.x);
  };
  // Cells and image of the second one: -0.935 in all.
  CHECK(share() == 1.0);
  // The cells of two others: -1.105 in all.
  parked.keyframes.push_back(parked.keyframes[1]);
  for (const std::size_t k : {1U, 2U}) parked.keyframes[k].images.clear();
  CHECK(share() == 0.0);
}

TEST_CASE("of more revisits than configured the nearest are used", "[refinement]") {
  SessionData ghost;
  ghost.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  SessionData saw_through;
  saw_through.keyframes.push_back(keyframe_of(0, {kWall}));
  SessionData observed;
  for (std::uint32_t k = 0; k < 3; ++k) {
    observed.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
  }
  RefinementConfig config;
  const auto share = [&](double saw_through_m, double observed_m) {
    PosedSession near = posed(saw_through);
    PosedSession far = posed(observed);
    for (Pose& pose : near.T_map_keyframe) pose.translation.y() = saw_through_m;
    for (Pose& pose : far.T_map_keyframe) pose.translation.y() = observed_m;
    return dynamic_share(ghost.keyframes[0], refine({posed(ghost), near, far}, config, 1)[0][0],
                         kPerson.x);
  };
  config.revisits = 1;
  CHECK(share(0.01, 0.02) == 1.0);
  CHECK(share(0.02, 0.01) == 0.0);
  // Three against one.
  config.revisits = 4;
  CHECK(share(0.01, 0.02) == 0.0);
  config.revisits = 0;
  CHECK(share(0.01, 0.02) == 0.0);
}

TEST_CASE("keyframes of the same session beyond the window are revisits", "[refinement]") {
  SessionData session;
  session.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  session.keyframes.push_back(keyframe_of(1, {}));  // saw nothing at all
  session.keyframes.push_back(keyframe_of(2, {kWall}));
  session.keyframes.push_back(keyframe_of(3, {kWall}));
  RefinementConfig config;
  config.window = 1;
  const auto share = [&] {
    return dynamic_share(session.keyframes[0], refine({posed(session)}, config, 1)[0][0],
                         kPerson.x);
  };
  config.revisits = 0;
  CHECK(share() == 0.0);
  config.revisits = 10;
  CHECK(share() == 1.0);
}

TEST_CASE("a revisit that observed a cell speaks against its having been seen through",
          "[refinement]") {
  SessionData ghost;
  ghost.keyframes.push_back(keyframe_of(0, {kWall, kPerson}));
  ghost.keyframes.push_back(keyframe_of(1, {}));
  RefinementConfig config;
  config.window = 1;
  // One saw through, 0.85, against the first keyframe's own image, 0.255, and the cells of so many
  // revisits without images, 0.425 each.
  const auto shares = [&](std::uint32_t observed) {
    SessionData other_day;
    other_day.keyframes.push_back(keyframe_of(0, {kWall}));
    for (std::uint32_t k = 1; k <= observed; ++k) {
      other_day.keyframes.push_back(keyframe_of(k, {kWall, kPerson}));
      other_day.keyframes.back().images.clear();
    }
    SessionData both = ghost;
    for (const KeyframeRecord& keyframe : other_day.keyframes) both.keyframes.push_back(keyframe);
    const double apart = dynamic_share(
        ghost.keyframes[0], refine({posed(ghost), posed(other_day)}, config, 1)[0][0], kPerson.x);
    const double together =
        dynamic_share(both.keyframes[0], refine({posed(both)}, config, 1)[0][0], kPerson.x);
    return std::pair(apart, together);
  };
  CHECK(shares(1) == std::pair(1.0, 1.0));
  CHECK(shares(2) == std::pair(0.0, 0.0));
}

TEST_CASE("every keyframe of a long session is refined", "[refinement]") {
  SessionData session;
  for (std::uint32_t k = 0; k < 130; ++k) {
    const bool has_person = k % 60 == 9;
    session.keyframes.push_back(has_person ? keyframe_of(k, {kWall, kPerson})
                                           : keyframe_of(k, {kWall}));
  }
  const auto refined = refine({posed(session)}, {}, 1);
  REQUIRE(refined[0].size() == 130);
  for (const std::size_t k : {9U, 69U, 129U}) {
    CHECK(dynamic_share(session.keyframes[k], refined[0][k], kPerson.x) == 1.0);
  }
}
