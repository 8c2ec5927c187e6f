// Sliding-window block index against a model made of standard maps
#include "src/onboard/removal/block_window.hpp"

#include <deque>

#include "run.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

/// A block's index, counted from the odometry origin.
using BlockIndex = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

struct OwnedWindow {
  explicit OwnedWindow(const PipelineConfig& configuration)
      : config(configuration),
        block(lay_out([this](Arena& arena) { window.allocate(arena, config); })) {}
  PipelineConfig config;
  BlockWindow window;
  MemoryBlock block;
};

PipelineConfig windowed(std::uint32_t keyframes, std::uint32_t blocks) {
  PipelineConfig config = small_config();
  config.removal.window = keyframes;
  config.voxel.max_window_blocks = blocks;
  return config;
}

/// Drives a cloud of blocks along x and holds the same in standard maps.
class Drive {
 public:
  explicit Drive(OwnedWindow& owned) : owned_(owned) {}

  /// One keyframe of random blocks about `x_m`; returns their indices by number.
  std::vector<BlockIndex> keyframe(double x_m, int blocks, int reach = 9) {
    const Grid grid = grid_near({x_m, 0.0, 0.0}, owned_.config.voxel);
    const std::int64_t step = grid.step_cells() / 4;
    const std::array<std::int64_t, 3> origin{grid.lattice_x * step, grid.lattice_y * step,
                                             grid.lattice_z * step};
    owned_.window.begin(grid);
    std::uniform_int_distribution<int> across(-reach, reach);
    std::map<BlockIndex, std::uint32_t> numbers;
    std::vector<BlockIndex> indices;
    for (int i = 0; i < blocks; ++i) {
      const VoxelIndex block{across(random_), across(random_), across(random_) / 3};
      const BlockIndex index{origin[0] + block.x, origin[1] + block.y, origin[2] + block.z};
      const std::uint32_t number = owned_.window.enter(block);
      const auto known = numbers.find(index);
      if (known != numbers.end()) {
        CHECK(number == known->second);  // entered twice, numbered once
        continue;
      }
      if (number == BlockWindow::kNone) continue;
      REQUIRE(number == indices.size());
      numbers[index] = number;
      indices.push_back(index);
    }
    std::vector<std::uint64_t> entered;
    for (const BlockIndex& index : indices) {
      entered.push_back(bits_(random_) | 1U);
      occupied_[index] = entered.back();
    }
    owned_.window.arrange(entered);
    const std::span<const std::uint32_t> order = owned_.window.order();
    REQUIRE(order.size() == indices.size());
    std::vector<BlockIndex> arranged;
    for (const std::uint32_t first_number : order) {
      arranged.push_back(indices[first_number]);
      numbers[indices[first_number]] = static_cast<std::uint32_t>(arranged.size() - 1);
    }
    check_neighbours(arranged, numbers);
    return arranged;
  }

  /// Records random labels and moves on.
  void finish(const std::vector<BlockIndex>& indices) {
    std::map<BlockIndex, BlockHistory> decided;
    for (std::uint32_t number = 0; number < indices.size(); ++number) {
      const std::uint64_t occupied = occupied_.at(indices[number]);
      const std::uint64_t dynamic = occupied & bits_(random_);
      decided[indices[number]] = {occupied, dynamic, dynamic & bits_(random_), number * 7};
      owned_.window.record(number, decided[indices[number]]);
    }
    owned_.window.advance();
    history_.push_front(decided);
    if (history_.size() > owned_.config.removal.window) history_.pop_back();
  }

  /// Nothing of the current keyframe is left.
  void discard() { owned_.window.discard(); }

  /// Everything the window says about earlier keyframes, up to `remembered` of them.
  void check_history(const std::vector<BlockIndex>& indices, std::size_t remembered) const {
    for (std::uint32_t number = 0; number < indices.size(); ++number) {
      std::uint64_t together = 0;
      for (std::uint32_t age = 1; age <= owned_.config.removal.window; ++age) {
        const BlockHistory truth = age <= remembered ? at(indices[number], age) : BlockHistory{};
        REQUIRE(owned_.window.occupied(number, age) == truth.occupied);
        together ^= truth.occupied;
      }
      std::uint64_t listed = 0;
      for (const std::uint64_t word : owned_.window.occupied(number)) listed ^= word;
      REQUIRE(listed == (together ^ occupied_.at(indices[number])));
      const BlockHistory truth = remembered > 0 ? at(indices[number], 1) : BlockHistory{};
      const BlockHistory before = owned_.window.before(number);
      REQUIRE(before.occupied == truth.occupied);
      if (truth.occupied == 0) continue;
      REQUIRE(before.dynamic == truth.dynamic);
      REQUIRE(before.proven == truth.proven);
      REQUIRE(before.first == truth.first);
    }
  }
  [[nodiscard]] std::size_t kept() const { return history_.size(); }
  void forget() { history_.clear(); }

 private:
  [[nodiscard]] BlockHistory at(const BlockIndex& index, std::uint32_t age) const {
    if (age > history_.size()) return {};
    const auto found = history_[age - 1].find(index);
    return found == history_[age - 1].end() ? BlockHistory{} : found->second;
  }

  void check_neighbours(const std::vector<BlockIndex>& indices,
                        const std::map<BlockIndex, std::uint32_t>& numbers) const {
    for (std::uint32_t number = 0; number < indices.size(); ++number) {
      const auto& [x, y, z] = indices[number];
      for (std::int32_t n = 0; n < 27; ++n) {
        const BlockOffset offset{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
        const auto other = numbers.find({x + offset.x, y + offset.y, z + offset.z});
        REQUIRE(owned_.window.neighbour(number, offset) ==
                (other == numbers.end() ? BlockWindow::kNone : other->second));
      }
    }
  }

  OwnedWindow& owned_;
  std::mt19937_64 random_{7};
  std::uniform_int_distribution<std::uint64_t> bits_;
  std::map<BlockIndex, std::uint64_t> occupied_;  ///< in the current keyframe
  std::deque<std::map<BlockIndex, BlockHistory>> history_;
};

}  // namespace

TEST_CASE("a window stores what each keyframe occupied of a block, and which blocks touch it") {
  OwnedWindow owned(windowed(5, 20000));
  Drive drive(owned);
  // Far enough for tiles to be given back and used again many times.
  for (int k = 0; k < 300; ++k) {
    const auto indices = drive.keyframe(3.0 * k - 200.0, 400);
    REQUIRE(indices.size() > 200);
    drive.check_history(indices, drive.kept());
    drive.finish(indices);
  }
}

TEST_CASE("a window that is full forgets its oldest keyframes first and goes on") {
  // Room for the blocks of about two keyframes; the window asks for six.
  OwnedWindow owned(windowed(5, 600));
  Drive drive(owned);
  std::size_t least = 5;
  std::size_t most = 0;
  for (int k = 0; k < 100; ++k) {
    const auto indices = drive.keyframe(0.1 * k, 300);
    REQUIRE(indices.size() > 200);
    REQUIRE(owned.window.size() <= owned.window.capacity());
    std::size_t remembered = drive.kept();
    // What is gone is gone from the old end: the newest keyframes are all that is left.
    const auto knows = [&](std::size_t age) {
      for (std::uint32_t n = 0; n < indices.size(); ++n) {
        if (owned.window.occupied(n, static_cast<std::uint32_t>(age)) != 0) return true;
      }
      return false;
    };
    while (remembered > 0 && !knows(remembered)) --remembered;
    if (k > 0) {
      least = std::min(least, remembered);
      most = std::max(most, remembered);
    }
    drive.check_history(indices, remembered);
    drive.finish(indices);
  }
  CHECK(least >= 1);
  CHECK(most < 5);
}

TEST_CASE("a window agrees with its model under random loads, whatever runs out first") {
  // Room for everything; for few tiles (a quarter of the blocks, 64 at least); for few blocks.
  const auto [keyframes, capacity] =
      GENERATE(table<std::uint32_t, std::uint32_t>({{3, 2000}, {2, 256}, {5, 400}, {4, 1200}}));
  INFO(keyframes << " keyframes, " << capacity << " blocks");
  OwnedWindow owned(windowed(keyframes, capacity));
  Drive drive(owned);
  std::mt19937 random(keyframes);
  const auto draw = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  double x_m = 0.0;
  for (int k = 0; k < 500; ++k) {
    // Back and forth, so that tiles are given back beside others that stay; now and then far off.
    x_m += draw(0, 9) == 0 ? draw(-60, 60) : 0.4 * draw(-10, 10);
    const int blocks = draw(0, 9) == 0 ? draw(300, 900) : draw(1, 150);
    const std::uint32_t remembered = owned.window.earlier_count();
    const auto indices = drive.keyframe(x_m, blocks, draw(2, 9));
    REQUIRE(owned.window.size() <= owned.window.capacity());
    // Blocks or tiles have run out: the window says that it is full.
    if (owned.window.earlier_count() < remembered) {
      REQUIRE(owned.window.size() == owned.window.capacity());
    }
    if (capacity == 2000) REQUIRE(owned.window.earlier_count() == drive.kept());
    drive.check_history(indices, std::min<std::size_t>(drive.kept(), owned.window.earlier_count()));
    if (draw(0, 4) == 0) {
      drive.discard();
    } else {
      drive.finish(indices);
    }
    if (draw(0, 99) == 0) {
      owned.window.forget();
      drive.forget();
    }
  }
}

TEST_CASE("a keyframe with more blocks than fit gets as many as there is room for") {
  OwnedWindow owned(windowed(3, 100));
  Drive drive(owned);
  for (int k = 0; k < 20; ++k) {
    const auto indices = drive.keyframe(5.0 * k, 1000);
    CHECK(indices.size() == 100);
    drive.finish(indices);
  }
}

TEST_CASE("a window starts anew where its first keyframe can no longer be counted from") {
  OwnedWindow owned(windowed(3, 5000));
  Drive drive(owned);
  for (const double x : {0.0, 1.0, 5e6, 5e6 + 1.0}) {
    if (x == 5e6) drive.forget();
    const auto indices = drive.keyframe(x, 200);
    drive.check_history(indices, drive.kept());
    drive.finish(indices);
  }
  owned.window.forget();
  drive.forget();
  drive.check_history(drive.keyframe(5e6, 200), 0);
}

TEST_CASE("a directory says at once that a key can neither be found nor added") {
  constexpr std::uint32_t kCapacity = 1024;
  Owned<TileDirectory> directory(kCapacity);
  // Keys that all belong into the same slot.
  std::vector<VoxelKey> keys;
  for (VoxelKey key = 0; keys.size() < TileDirectory::kMaxProbes + 1; ++key) {
    if (mix_bits(key) % (2 * kCapacity) == 5) keys.push_back(key);
  }
  for (std::uint32_t i = 0; i < TileDirectory::kMaxProbes; ++i) {
    CHECK(directory->find(keys[i]) == TileDirectory::kNone);
    CHECK(directory->insert(keys[i], i));
    CHECK(directory->find(keys[i]) == i);
  }
  CHECK(directory->find(keys.back()) == TileDirectory::kFull);
  CHECK_FALSE(directory->insert(keys.back(), 99));
  CHECK(directory->find(keys.front()) == 0);
  directory->clear();
  CHECK(directory->find(keys.back()) == TileDirectory::kNone);
}
