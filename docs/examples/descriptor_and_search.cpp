// The stages alone: describing and recognising places without the pipeline.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <unimapper/place/database.hpp>
#include <unimapper/place/describer.hpp>
#include <vector>

using namespace unimapper;

int main() {
  const DescriptorConfig descriptor;
  LoopSearchConfig search;
  search.max_places = 100;
  PlaceDescriber describer;
  PlaceDatabase database;
  Arena measuring = Arena::measuring();  // the same layout twice: counted first, then for good
  describer.allocate(measuring, descriptor);
  database.allocate(measuring, search);
  auto* const block = static_cast<std::byte*>(std::aligned_alloc(64, measuring.used()));
  if (block == nullptr) return std::puts("out of memory"), 1;
  Arena arena(block, measuring.used());
  describer.allocate(arena, descriptor);
  database.allocate(arena, search);

  std::vector<FineCell> cells;  // a static cloud at 0.2 m, gravity-levelled; here 40 walls
  for (int i = 0; i < 8400; ++i) {
    const int wall = i / 210;
    const float along = 0.2F * (i % 21) - 2, range = 8 + 0.9F * wall;
    const float x = range * std::sin(2.4F * wall) + along * std::cos(1.7F * wall);
    const float y = range * std::cos(2.4F * wall) + along * std::sin(1.7F * wall);
    cells.push_back({{x, y, 0.3F * (i / 21 % 10) - 1}, 1, 0, 0});
  }
  const PlaceView place = describer.describe(cells);
  std::printf("%zu keypoints, %zu planes\n", place.keypoints.size(), place.planes.size());
  database.insert(place, {1, 0}, Pose{});
  for (const LoopCandidate& loop : database.search(place, {2, 0}, {}))
    std::printf("recognised with confidence %.2f\n", static_cast<double>(loop.confidence));
  std::free(block);
}
