#include "session_voxels.hpp"

#include <algorithm>
#include <utility>

namespace unimapper::merge {

Eigen::Vector3f SessionVoxels::Voxel::position(VoxelKey key, float size_m) const {
  return voxel_corner(key, size_m) + sum / static_cast<float>(cells);
}

SessionVoxels::SessionVoxels(float size_m, std::shared_ptr<ScratchFile> file,
                             std::size_t most_in_memory)
    : size_m_(size_m), file_(std::move(file)), most_in_memory_(most_in_memory) {}

void SessionVoxels::add(const VoxelIndex& voxel, const Eigen::Vector3f& from_corner,
                        const FineCell& cell) {
  Tile& tile = loaded(tile_of(voxel));
  const std::uint32_t number = tile.table.find_or_insert(pack(voxel));
  if (number == tile.voxels.size()) {
    tile.voxels.emplace_back();
    ++in_memory_;
    ++size_;
  }
  Voxel& sum = tile.voxels[number];
  sum.sum += from_corner;
  ++sum.cells;
  sum.ground += cell.ground != 0 ? 1 : 0;
  if (cell.intensity == 0) return;
  sum.intensity.add(cell.intensity);
  has_intensity_ = true;
}

void SessionVoxels::finish() {
  for (auto& [index, tile] : tiles_) {
    if (file_ != nullptr) {
      move_to_file(tile);
    } else {
      tile.table.keep_keys_only();
      tile.voxels.shrink_to_fit();
    }
  }
  latest_ = nullptr;
}

std::map<MapTile, std::size_t> SessionVoxels::sizes() const {
  std::map<MapTile, std::size_t> sizes;
  for (const auto& [index, tile] : tiles_) sizes[index] = tile.voxels.size() + tile.in_file;
  return sizes;
}

void SessionVoxels::read(const Tile& tile, std::size_t first, std::vector<VoxelKey>& keys,
                         std::vector<Voxel>& voxels) const {
  const std::size_t count = std::min(kAtOnce, tile.in_file - first);
  keys.resize(count);
  voxels.resize(count);
  file_->read(tile.keys_at + first * sizeof(VoxelKey), keys.data(), count * sizeof(VoxelKey));
  file_->read(tile.voxels_at + first * sizeof(Voxel), voxels.data(), count * sizeof(Voxel));
}

SessionVoxels::Tile& SessionVoxels::loaded(const MapTile& tile) {
  if (latest_ != nullptr && latest_tile_ == tile) return *latest_;
  if (file_ != nullptr && in_memory_ > most_in_memory_) move_least_recent();
  Tile& found = tiles_[tile];
  latest_tile_ = tile;
  latest_ = &found;
  found.used = ++uses_;
  if (found.in_file == 0) return found;
  Tile back;
  back.used = found.used;
  std::vector<VoxelKey> keys;
  std::vector<Voxel> voxels;
  for (std::size_t first = 0; first < found.in_file; first += kAtOnce) {
    read(found, first, keys, voxels);
    for (const VoxelKey key : keys) back.table.find_or_insert(key);
    back.voxels.insert(back.voxels.end(), voxels.begin(), voxels.end());
  }
  in_memory_ += back.voxels.size();
  found = std::move(back);
  return found;
}

void SessionVoxels::move_to_file(Tile& tile) {
  static_assert(sizeof(Voxel) == sizeof(float) * 3 + sizeof(std::uint32_t) * 3, "no gaps");
  if (tile.voxels.empty()) return;
  tile.in_file = tile.voxels.size();
  tile.keys_at = file_->append(tile.table.keys().data(), tile.in_file * sizeof(VoxelKey));
  tile.voxels_at = file_->append(tile.voxels.data(), tile.in_file * sizeof(Voxel));
  in_memory_ -= tile.in_file;
  tile.table.clear();
  tile.voxels = std::vector<Voxel>();
}

void SessionVoxels::move_least_recent() {
  std::vector<Tile*> in_memory;
  for (auto& [index, tile] : tiles_) {
    if (!tile.voxels.empty()) in_memory.push_back(&tile);
  }
  std::sort(in_memory.begin(), in_memory.end(),
            [](const Tile* a, const Tile* b) { return a->used < b->used; });
  for (Tile* tile : in_memory) {
    if (in_memory_ <= most_in_memory_ / 2) break;
    move_to_file(*tile);
  }
  latest_ = nullptr;
}

}  // namespace unimapper::merge
