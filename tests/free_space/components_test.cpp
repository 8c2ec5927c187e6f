// Component labelling against plain flooding, on both storages
#include "src/free_space/components.hpp"

#include "src/free_space/ground_patch.hpp"
#include "storages.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

using Cell = std::array<std::int32_t, 3>;

/// Cells as blocks, in any order of cells.
struct Grid {
  explicit Grid(const std::set<Cell>& connecting, const std::set<Cell>& low = {}) {
    for (const Cell& cell : connecting) add(cell, &LabelledCells::connecting);
    for (const Cell& cell : low) add(cell, &LabelledCells::low);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      blocks[b].occupied = cells[b].connecting | cells[b].low;
      blocks[b].first = rows;
      rows += popcount(blocks[b].occupied);
    }
  }
  void add(const Cell& cell, std::uint64_t LabelledCells::*kind) {
    const VoxelIndex index{cell[0], cell[1], cell[2]};
    const VoxelIndex block = block_of(index);
    const auto [at, is_new] =
        number.try_emplace({block.x, block.y, block.z}, static_cast<std::uint32_t>(blocks.size()));
    if (is_new) {
      blocks.push_back({0, block, 0});
      cells.push_back({0, 0});
    }
    cells[at->second].*kind |= std::uint64_t{1} << bit_of(index);
  }
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t b, const BlockOffset& to) const {
    const VoxelIndex& at = blocks[b].index;
    const auto found = number.find({at.x + to.x, at.y + to.y, at.z + to.z});
    return found == number.end() ? ComponentLabels::kNone : found->second;
  }

  std::map<Cell, std::uint32_t> number;
  std::vector<Block> blocks;
  std::vector<LabelledCells> cells;
  std::uint32_t rows = 0;
};

/// Component of every labelled cell; `count` is what `label` returned.
template <typename Labels>
std::map<Cell, std::uint32_t> labels_of(const Grid& grid, std::uint32_t& count,
                                        std::size_t parts_per_block = 8) {
  Labels labels(grid.blocks.size(), grid.blocks.size() * parts_per_block);
  count = labels->label(
      static_cast<std::uint32_t>(grid.blocks.size()),
      [&](std::uint32_t b) { return grid.cells[b]; },
      [&](std::uint32_t b, const BlockOffset& to) { return grid.neighbour(b, to); });
  std::map<Cell, std::uint32_t> component;
  for (std::uint32_t b = 0; b < grid.blocks.size(); ++b) {
    labels->visit(b, [&](std::uint32_t number, std::uint64_t some) {
      REQUIRE(number < labels->size());
      for (; some != 0; some &= some - 1) {
        const auto bit = static_cast<std::uint32_t>(std::countr_zero(some));
        const VoxelIndex cell = cell_in(grid.blocks[b].index, bit);
        REQUIRE(component.emplace(Cell{cell.x, cell.y, cell.z}, number).second);
      }
    });
  }
  return component;
}

template <typename Visit>
void visit_neighbours(const Cell& cell, const Visit& visit) {
  for (int n = 0; n < 27; ++n) {
    if (n != 13) visit(Cell{cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
  }
}

/// Numbers of components by flooding.
std::map<Cell, int> flooded_labels(const std::set<Cell>& cells, int& count) {
  std::map<Cell, int> label;
  count = 0;
  for (const Cell& seed : cells) {
    if (label.count(seed) != 0) continue;
    std::vector<Cell> open{seed};
    label[seed] = count;
    while (!open.empty()) {
      const Cell cell = open.back();
      open.pop_back();
      visit_neighbours(cell, [&](const Cell& other) {
        if (cells.count(other) != 0 && label.try_emplace(other, count).second) {
          open.push_back(other);
        }
      });
    }
    ++count;
  }
  return label;
}

std::set<Cell> random_cells(std::mt19937& random, int size, int count) {
  std::set<Cell> cells;
  std::uniform_int_distribution<int> along(-size, size);
  for (int i = 0; i < count; ++i) cells.insert({along(random), along(random), along(random)});
  return cells;
}

}  // namespace

TEMPLATE_TEST_CASE("Labels are those of plain flooding, whatever touches and however", "",
                   Owned<ComponentLabels>, OnHeap<ComponentLabels>) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 60; ++trial) {
    const std::set<Cell> cells = random_cells(random, 3 + trial % 8, 20 + 10 * trial);
    int expected = 0;
    const std::map<Cell, int> truth = flooded_labels(cells, expected);
    std::uint32_t count = 0;
    const auto labels = labels_of<TestType>(Grid(cells), count);
    REQUIRE(count == static_cast<std::uint32_t>(expected));
    REQUIRE(labels.size() == cells.size());
    std::map<int, std::uint32_t> number_of;
    for (const auto& [cell, label] : truth) {
      REQUIRE(number_of.try_emplace(label, labels.at(cell)).first->second == labels.at(cell));
    }
    std::set<std::uint32_t> different;
    for (const auto& [label, number] : number_of) different.insert(number);
    REQUIRE(different.size() == number_of.size());
  }
}

TEMPLATE_TEST_CASE("A low cell follows a component it touches and joins none", "",
                   Owned<ComponentLabels>, OnHeap<ComponentLabels>) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 40; ++trial) {
    const std::set<Cell> cells = random_cells(random, 6, 60 + 5 * trial);
    std::set<Cell> low = random_cells(random, 6, 60);
    for (const Cell& cell : cells) low.erase(cell);
    std::uint32_t without = 0;
    std::uint32_t with = 0;
    labels_of<TestType>(Grid(cells), without);
    const auto labels = labels_of<TestType>(Grid(cells, low), with);
    REQUIRE(with == without);
    for (const Cell& cell : low) {
      std::set<std::uint32_t> touched;
      visit_neighbours(cell, [&](const Cell& other) {
        if (cells.count(other) != 0) touched.insert(labels.at(other));
      });
      const auto own = labels.find(cell);
      REQUIRE((own != labels.end()) == !touched.empty());
      if (own != labels.end()) REQUIRE(touched.count(own->second) == 1);
    }
  }
}

TEST_CASE("Of several components a low cell follows that of its own block, then the upper one") {
  const Cell low{4, 3, 3};  // at an edge of its block
  const Cell above{5, 4, 4};
  const Cell beside{3, 4, 3};
  const Cell own_block{5, 3, 2};
  std::uint32_t count = 0;
  const auto two = labels_of<OnHeap<ComponentLabels>>(Grid({above, beside}, {low}), count);
  CHECK(count == 2);
  CHECK(two.at(low) == two.at(above));
  const auto three =
      labels_of<OnHeap<ComponentLabels>>(Grid({above, beside, own_block}, {low}), count);
  CHECK(count == 3);
  CHECK(three.at(low) == three.at(own_block));
}

TEST_CASE("A block is one component if there is no capacity for its parts") {
  // Eight cells of one block, none of which touches another.
  std::set<Cell> corners;
  for (int i = 0; i < 8; ++i) corners.insert({2 * (i & 1), i & 2, (i & 4) / 2});
  std::uint32_t count = 0;
  labels_of<Owned<ComponentLabels>>(Grid(corners), count);
  CHECK(count == 8);
  labels_of<Owned<ComponentLabels>>(Grid(corners), count, 2);
  CHECK(count == 2);
  const auto one = labels_of<Owned<ComponentLabels>>(Grid(corners), count, 1);
  CHECK(count == 1);
  CHECK(one.size() == 8);
}

TEST_CASE("A block without room for its parts is counted") {
  const std::uint64_t apart = 0b0101;
  const auto crowded = [](std::size_t parts, const LabelledCells& cells) {
    Owned<ComponentLabels> labels(1, parts);
    (void)labels->label(
        1, [&](std::uint32_t) { return cells; },
        [](std::uint32_t, const BlockOffset&) { return ComponentLabels::kNone; });
    return labels->crowded();
  };
  CHECK(crowded(2, {apart, 0}) == 0);
  CHECK(crowded(1, {apart, 0}) == 1);
}

TEST_CASE("A component is dynamic from one share on and static below the other") {
  CHECK(classify(30, 100, 0.3F, 0.1F) == ComponentClass::kDynamic);
  CHECK(classify(29, 100, 0.3F, 0.1F) == ComponentClass::kMixed);
  CHECK(classify(10, 100, 0.3F, 0.1F) == ComponentClass::kMixed);
  CHECK(classify(9, 100, 0.3F, 0.1F) == ComponentClass::kStatic);
  CHECK(classify(0, 0, 0.3F, 0.1F) == ComponentClass::kStatic);
}

TEST_CASE("A patch of ground is rejected from a share on, unless it has too few cells") {
  GroundPatch patch;
  CHECK_FALSE(patch.is_transparent(0.7F, 1));
  patch.add(true);
  CHECK(patch.is_transparent(0.7F, 1));
  CHECK_FALSE(patch.is_transparent(0.7F, 2));
  patch.add(true);
  CHECK(patch.is_transparent(0.7F, 2));
  const auto is_transparent = [](int seen_through, int cells) {
    GroundPatch some;
    for (int i = 0; i < cells; ++i) some.add(i < seen_through);
    return some.is_transparent(0.7F, 2);
  };
  CHECK(is_transparent(7, 10));
  CHECK_FALSE(is_transparent(6, 10));
  CHECK(is_transparent(70000, 70000));
  CHECK_FALSE(is_transparent(0, 70000));
}
