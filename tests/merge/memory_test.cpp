// Memory of a merge: arenas, temporary files, keyframes that are read on demand
#include <sys/resource.h>

#include <csignal>

#include "src/merge/in_arena.hpp"
#include "src/merge/limited_cache.hpp"
#include "src/merge/sessions/keyframe_cache.hpp"
#include "tests/merge/exported_files.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/export.hpp"
#include "unimapper/merge/external_vector.hpp"
#include "unimapper/merge/keyframe_level.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/place/database.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using namespace unimapper::merge::testing;
using Catch::Matchers::Contains;

TEST_CASE("a block of large pages suits an arena, however large it is") {
  for (const std::size_t bytes :
       {std::size_t{1}, std::size_t{1000}, (std::size_t{1} << 21U) - 1, std::size_t{5'000'000}}) {
    const LargePageBlock block(bytes);
    REQUIRE(block.size() >= bytes);
    CHECK(reinterpret_cast<std::uintptr_t>(block.data()) % Arena::kAlignment == 0);
    std::memset(block.data(), 0xA5, block.size());
  }
}

TEST_CASE("a component is laid out for a configuration that is valid, and for no other") {
  LoopSearchConfig config;
  config.max_places = 3;
  InArena<PlaceDatabase> database(config);
  CHECK(database.bytes() > 0);
  CHECK(database->size() == 0);
  config.max_places = 0;
  CHECK_THROWS_AS(InArena<PlaceDatabase>(config), std::invalid_argument);
}

namespace {

/// Files of this process cannot grow beyond a size: as if the disk were full.
class LargestFile {
 public:
  explicit LargestFile(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~LargestFile() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  LargestFile(const LargestFile&) = delete;
  LargestFile& operator=(const LargestFile&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace

TEST_CASE("A scratch file gives back what was appended, and has no name", "[scratch]") {
  const TemporaryDirectory folder;
  ScratchFile file(folder.path());
  std::vector<std::uint32_t> numbers(1000);
  std::iota(numbers.begin(), numbers.end(), 7U);
  CHECK(file.append(numbers.data(), 4 * numbers.size()) == 0);
  CHECK(file.append(numbers.data(), 40) == 4 * numbers.size());
  std::array<std::uint32_t, 3> read{};
  file.read(4 * 998, read.data(), sizeof read);
  CHECK((read == std::array<std::uint32_t, 3>{1005, 1006, 7}));
  CHECK(std::filesystem::is_empty(folder.path()));
  CHECK_THROWS_WITH(file.read(4 * 1009, read.data(), sizeof read), Contains("cannot be read"));
}

TEST_CASE("A scratch file that cannot be made or written is an error", "[scratch]") {
  const TemporaryDirectory folder;
  CHECK_THROWS_WITH(ScratchFile(folder.path() / "nowhere"), Contains("cannot be made"));
  ScratchFile file(folder.path());
  const std::vector<char> bytes(10'000);
  const LargestFile full(5'000);
  CHECK_THROWS_WITH(file.append(bytes.data(), bytes.size()), Contains("cannot be written"));
}

TEST_CASE("A vector in a file is read as it is in memory, from any place and by its copies",
          "[scratch]") {
  const TemporaryDirectory folder;
  const auto file = std::make_shared<ScratchFile>(folder.path());
  for (const std::uint64_t count : {0ULL, 1ULL, 8191ULL, 8192ULL, 8193ULL, 50'000ULL}) {
    INFO(count);
    ExternalVector<std::uint64_t> there(file);
    ExternalVector<std::uint64_t> here;
    for (std::uint64_t i = 0; i < count; ++i) {
      there.push_back(7 * i);
      here.push_back(7 * i);
    }
    CHECK(there.size() == count);
    CHECK(there.empty() == (count == 0));
    CHECK(std::equal(there.begin(), there.end(), here.begin(), here.end()));
    // A copy has what was there, and what comes later is its own.
    ExternalVector<std::uint64_t> copy = there;
    for (std::uint64_t i = 0; i < 9'000; ++i) copy.push_back(i);
    there.push_back(1);
    CHECK(copy.size() == count + 9'000);
    CHECK(std::equal(here.begin(), here.end(), copy.begin()));
    // An iterator that stays behind reads on where it was.
    auto behind = there.begin();
    std::uint64_t sum = 0;
    for (const std::uint64_t value : there) sum += value;
    CHECK(sum == 7 * count * (count > 0 ? count - 1 : 0) / 2 + 1);
    if (count > 0) CHECK(*behind == 0);
  }
}

namespace {

/// The same session without cells and images, which are read from `whole` on demand.
SessionData on_demand(const SessionData& whole, KeyframeCache& cache,
                      std::atomic<int>* times_read = nullptr) {
  SessionData light = whole;
  for (KeyframeRecord& keyframe : light.keyframes) drop_contents(keyframe);
  light.contents = cache.contents([&whole, times_read](std::uint32_t sequence) {
    if (times_read != nullptr) ++*times_read;
    return whole.keyframes.at(sequence);
  });
  return light;
}

/// Every exported file but the durations; voxels are in a file of the folder, or in memory.
std::map<std::string, std::string> exported(const std::vector<SessionData>& sessions,
                                            const MergeConfig& config, bool in_file = false) {
  const TemporaryDirectory folder;
  const std::filesystem::path scratch = in_file ? folder.path() : std::filesystem::path();
  ExportOptions options;
  options.tile_m = 40.0;
  options.grid.emplace();
  export_map(folder.path(), sessions, merge_sessions(sessions, config, {}, {}, nullptr, scratch),
             options);
  return exported_files(folder.path());
}

constexpr auto kOneByteEach = [](int) { return std::uint64_t{1}; };

/// Room for two values, which are ten times their keys, and how often one was made.
struct TwoValues {
  LimitedCache<int, int> cache{2};
  int made = 0;
  std::shared_ptr<const int> get(int key) {
    const auto make = [&](int k) { return ++made, 10 * k; };
    return cache.get(key, make, kOneByteEach);
  }
};

}  // namespace

TEST_CASE("A limited cache keeps what was used last, and what is in use lives on", "[cache]") {
  TwoValues values;
  const auto first = values.get(1);
  CHECK(*values.get(2) == 20);
  CHECK(*values.get(1) == 10);
  CHECK(values.made == 2);
  CHECK(*values.get(3) == 30);  // 2 was not used for longest
  CHECK(values.cache.bytes() == 2);
  CHECK(*values.get(1) == 10);
  CHECK(values.made == 3);
  CHECK(*values.get(2) == 20);
  CHECK(values.made == 4);
  CHECK(*first == 10);
  values.cache.forget_if([](int key) { return key == 2; });
  CHECK(values.cache.bytes() == 1);
  values.get(2);
  CHECK(values.made == 5);
}

TEST_CASE("What is offered to a limited cache is kept where there is room", "[cache]") {
  TwoValues values;
  values.get(1);
  for (const int key : {1, 2, 3}) values.cache.offer(key, std::make_shared<const int>(11 * key), 1);
  CHECK(values.cache.bytes() == 2);
  CHECK(*values.get(1) == 10);
  CHECK(*values.get(2) == 22);
  CHECK(values.made == 1);
  CHECK(*values.get(3) == 30);
}

TEST_CASE("A keyframe that was read anyway is not read again", "[cache]") {
  KeyframeRecord keyframe;
  keyframe.sequence = 4;
  keyframe.static_cells.resize(7);
  KeyframeCache cache(1'000'000);
  int times_read = 0;
  const auto contents = cache.contents([&](std::uint32_t) { return ++times_read, keyframe; });
  contents->offer(keyframe);
  CHECK(contents->whole(keyframe)->static_cells.size() == 7);
  CHECK(times_read == 0);
}

TEST_CASE("A value that cannot be made is tried again, and threads make each value once",
          "[cache]") {
  LimitedCache<int, int> cache(1000);
  const auto fail = [](int) -> int { throw std::runtime_error("unreadable"); };
  CHECK_THROWS_WITH(cache.get(1, fail, kOneByteEach), "unreadable");
  std::atomic<int> made{0};
  std::vector<std::thread> threads;
  std::atomic<int> sum{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      const auto make = [&](int k) { return ++made, k; };
      for (int key = 0; key < 100; ++key) sum += *cache.get(key, make, kOneByteEach);
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(made == 100);
  CHECK(sum == 4 * 4950);
}

TEST_CASE("A merge of keyframes that are read on demand is the same to the byte", "[cache][slow]") {
  const auto town = make_town(1, 2);
  std::vector<SessionData> whole{
      record(town, drive_roads({{0, 0}, {1, 0}, {1, 0.6}}), "a", 11).session,
      record(town, drive_roads({{0.2, 0}, {1, 0}, {1, 0.6}}), "b", 12).session};
  // Planes are found in the cells, and one keyframe has only a summary.
  for (SessionData& session : whole) {
    for (KeyframeRecord& keyframe : session.keyframes) keyframe.planes.clear();
  }
  whole[1].keyframes[2].is_summary = true;
  drop_contents(whole[1].keyframes[2]);
  MergeConfig config;
  config.threads = 1;
  config.loops.max_candidates_per_pair = 12;
  const auto wanted = exported(whole, config);
  REQUIRE(wanted.at("map.ply").size() > 50'000);
  // Room for a few keyframes and clouds.
  config.threads = 3;
  config.memory_mb = 2;
  KeyframeCache cache(config.kept_bytes());
  std::atomic<int> times_read{0};
  const std::vector<SessionData> light{on_demand(whole[0], cache, &times_read),
                                       on_demand(whole[1], cache, &times_read)};
  CHECK((exported(light, config) == wanted));
  CHECK((exported(light, config, true) == wanted));
  CHECK(times_read > static_cast<int>(2 * whole[0].keyframes.size()));
}

TEST_CASE("A keyframe without contents gives their memory back", "[cache]") {
  KeyframeRecord keyframe;
  keyframe.static_cells.resize(1000);
  keyframe.dynamic_cells.resize(1000);
  keyframe.images.resize(2);
  keyframe.images[1].code.resize(1000);
  const std::uint64_t whole = bytes_of(keyframe);
  CHECK(whole > 2000 * sizeof(FineCell) + 1000);
  drop_contents(keyframe);
  CHECK(bytes_of(keyframe) == sizeof(KeyframeRecord));
}

TEST_CASE("Keyframes that are read on demand come levelled", "[cache]") {
  SessionData whole = record(make_town(3, 2), drive_roads({{1, 0.4}, {1, 1}}), "a", 1).session;
  for (std::size_t k = 0; k < whole.keyframes.size(); ++k) {
    KeyframeRecord& keyframe = whole.keyframes[k];
    const bool knows = k + 1 == whole.keyframes.size();
    if (knows) keyframe.up = {true, 1e-6F, 0.0F, 1e-6F};
    keyframe.T_odometry_keyframe =
        keyframe.T_odometry_keyframe * turned_about(Eigen::Vector3d::UnitX(), knows ? 0.0 : 0.1);
  }
  KeyframeCache cache(1'000'000);
  SessionData light = on_demand(whole, cache);
  SessionData stored = whole;  // what `light` reads is not levelled
  CHECK(level_keyframes(light) == whole.keyframes.size() - 1);
  CHECK(level_keyframes(stored) == whole.keyframes.size() - 1);
  for (std::size_t k = 0; k < whole.keyframes.size(); ++k) {
    const auto read = whole_keyframe(light, k);
    const KeyframeRecord& levelled = stored.keyframes[k];
    REQUIRE(read->static_cells.size() == levelled.static_cells.size());
    for (std::size_t i = 0; i < levelled.static_cells.size(); ++i) {
      REQUIRE(read->static_cells[i].position == levelled.static_cells[i].position);
    }
    CHECK(read->T_odometry_keyframe.rotation == levelled.T_odometry_keyframe.rotation);
    CHECK(read->keypoints.size() == levelled.keypoints.size());
    CHECK(read->up.known);
  }
}
