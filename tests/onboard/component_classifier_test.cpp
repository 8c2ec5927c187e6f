// Classification of connected components
#include "src/onboard/component_classifier.hpp"

#include <catch2/catch.hpp>

#include "stages.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("obstacles that touch are one component, across block borders too") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  // A staircase of cells that touch by their corners only, and one apart.
  for (int i = 0; i < 12; ++i) {
    const float at = 0.1F + 0.2F * static_cast<float>(i);
    points.emplace_back(at, at, 3.0F + at);
  }
  points.emplace_back(10.0F, 10.0F, 3.0F);
  stages.add(points);
  stages.find_and_split_ground();
  REQUIRE(stages.cells.size() == 13);
  // A third of the staircase is dynamic: enough for all of it.
  for (std::uint32_t row = 0; row < 4; ++row) stages.cells.set(row, &CellMarks::dynamic);
  CHECK(stages.classify_components() == 2);
  std::size_t dynamic = 0;
  for (std::uint32_t row = 0; row < 13; ++row) {
    dynamic += stages.cells.has(row, &CellMarks::dynamic) ? 1 : 0;
  }
  CHECK(dynamic == 12);
  CHECK_FALSE(stages.cells.has(stages.row_at({10.0F, 10.0F, 3.0F}), &CellMarks::dynamic));
}

TEST_CASE(
    "hardly dynamic components become static, confirmed static cells resist their component") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(0.1F + 0.2F * static_cast<float>(i), 0.1F, 3.1F);
  stages.add(points);
  stages.find_and_split_ground();
  stages.cells.set(0, &CellMarks::dynamic);
  stages.classify_components();
  CHECK_FALSE(stages.cells.has(0, &CellMarks::dynamic));

  for (std::uint32_t row = 0; row < 20; ++row) stages.cells.set(row, &CellMarks::dynamic);
  stages.cells.set(39, &CellMarks::confirmed_static);
  stages.classify_components();
  CHECK(stages.cells.has(38, &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("evidence on few cells of a component outweighs its many unobserved cells") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(0.1F + 0.2F * static_cast<float>(i), 0.1F, 3.1F);
  stages.add(points);
  stages.find_and_split_ground();
  std::vector<std::int16_t> log_odds(stages.cells.size(), 0);
  for (std::uint32_t row = 0; row < 3; ++row) {
    log_odds[row] = 850;
    stages.cells.set(row, &CellMarks::dynamic);
  }
  stages.components.run(stages.window.blocks(), log_odds, stages.cells);
  CHECK(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("low cells follow an obstacle but do not tie obstacles together") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  for (const float x : {1.1F, 2.5F}) add_column(points, x, 1.1F, 0.2F, 1.8F);
  for (float x = 1.1F; x < 2.5F; x += 0.1F) points.emplace_back(x, 1.1F, 0.25F);  // a low kerb
  stages.add(points);
  REQUIRE(stages.find_and_split_ground() > 0);
  for (float z = 0.5F; z < 1.8F; z += 0.2F) {
    stages.cells.set(stages.row_at({1.1F, 1.1F, z}), &CellMarks::dynamic);
  }
  stages.classify_components();
  const auto dynamic = [&](float x, float z) {
    return stages.cells.has(stages.row_at({x, 1.1F, z}), &CellMarks::dynamic);
  };
  CHECK(dynamic(1.1F, 1.5F));
  CHECK(dynamic(1.1F, 0.25F));
  CHECK_FALSE(dynamic(1.9F, 0.25F));
  CHECK_FALSE(dynamic(2.5F, 1.5F));
  CHECK_FALSE(dynamic(2.5F, 0.25F));
}

TEST_CASE("a confirmed static wall does not tie a walker to what stands behind it") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 3; ++i)
    add_column(points, 1.1F + 0.2F * static_cast<float>(i), 1.1F, 3.0F, 5.0F);
  for (int i = 0; i < 9; ++i)
    add_column(points, 1.7F + 0.2F * static_cast<float>(i), 1.1F, 3.0F, 5.0F);
  stages.add(points);
  stages.find_and_split_ground();
  const auto mark = [&](float x, CellMark what) {
    for (float z = 3.1F; z < 5.0F; z += 0.2F) {
      stages.cells.set(stages.row_at({x, 1.1F, z}), what);
    }
  };
  mark(1.1F, &CellMarks::dynamic);
  mark(1.3F, &CellMarks::dynamic);
  mark(1.5F, &CellMarks::confirmed_static);
  CHECK(stages.classify_components() == 2);
  CHECK(stages.cells.has(stages.row_at({1.1F, 1.1F, 4.1F}), &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(stages.row_at({1.5F, 1.1F, 4.1F}), &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(stages.row_at({1.7F, 1.1F, 4.1F}), &CellMarks::dynamic));
}

TEST_CASE("what was proven dynamic a keyframe ago connects, confirmed static or not") {
  Stages stages;
  const auto add = [&](bool before) {
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 5; ++i)
      add_column(points, 1.1F + 0.2F * static_cast<float>(i), 1.1F, 3.0F, 5.0F);
    stages.add(points);
    stages.find_and_split_ground();
    for (float z = 3.1F; z < 5.0F; z += 0.2F) {
      const std::uint32_t row = stages.row_at({1.5F, 1.1F, z});
      stages.cells.set(row, before ? &CellMarks::dynamic : &CellMarks::confirmed_static);
      if (before) stages.cells.set(row, &CellMarks::proven);
    }
  };
  add(true);
  stages.window.record(stages.cells);
  stages.begin();
  add(false);
  CHECK(stages.classify_components() == 1);
}

TEST_CASE("low cells follow a dynamic component even where ground was taken for them before") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  add_column(points, 1.1F, 1.1F, 0.2F, 1.8F);
  stages.add(points);
  REQUIRE(stages.find_and_split_ground() > 0);
  for (float z = 0.5F; z < 1.8F; z += 0.2F) {
    stages.cells.set(stages.row_at({1.1F, 1.1F, z}), &CellMarks::dynamic);
  }
  const std::uint32_t foot = stages.row_at({1.1F, 1.1F, 0.25F});
  REQUIRE(stages.cells.has(foot, &CellMarks::low));
  stages.cells.set(foot, &CellMarks::confirmed_static);
  stages.classify_components();
  CHECK(stages.cells.has(foot, &CellMarks::dynamic));
}

TEST_CASE("strong evidence of a cell's own survives a static component") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 80; ++i) points.emplace_back(0.1F + 0.2F * static_cast<float>(i), 0.1F, 3.1F);
  stages.add(points);
  stages.find_and_split_ground();
  for (std::uint32_t row = 0; row < 2; ++row) stages.cells.set(row, &CellMarks::dynamic);
  stages.cells.set(0, &CellMarks::confirmed_dynamic);
  stages.classify_components();
  CHECK(stages.cells.has(0, &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(1, &CellMarks::dynamic));
}
