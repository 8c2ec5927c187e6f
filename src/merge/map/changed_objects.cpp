#include "changed_objects.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "src/core/union_find.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {
namespace {

/// Points in cells of this size that touch are one object: gaps up to it are bridged, gaps of twice
/// as much, as between parked cars, never.
constexpr float kLinkCell_m = 0.3F;
/// Cells around an object whose unknown voxels are its own.
constexpr int kGrowth = 2;
/// Of a changed object's points about which the other session knows anything, this share has
/// changed.
constexpr double kChangedShare = 0.5;
constexpr std::uint32_t kNoObject = 0xFFFFFFFFU;

/// Voxels by cells, and objects by cells.
class LinkCells {
 public:
  explicit LinkCells(const std::vector<ComparedVoxel>& voxels) {
    cell_of_.reserve(voxels.size());
    for (const ComparedVoxel& voxel : voxels) {
      const std::uint32_t cell =
          table_.find_or_insert(pack(voxel_index(voxel.position, 1.0F / kLinkCell_m)));
      if (cell == is_free_.size()) is_free_.push_back(0);
      if (voxel.presence == Presence::kFree) is_free_[cell] = 1;
      cell_of_.push_back(cell);
    }
    object_.assign(is_free_.size(), kNoObject);
  }

  /// Numbers the groups of touching cells with free voxels, in the order of their first cell.
  /// Returns how many there are.
  std::uint32_t label() {
    std::vector<std::uint32_t> parent(is_free_.size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto parent_of = [&](std::uint32_t cell) -> std::uint32_t& { return parent[cell]; };
    for (std::uint32_t cell = 0; cell < is_free_.size(); ++cell) {
      if (is_free_[cell] == 0) continue;
      outermost_.push_back(cell);
      for_neighbours(cell, [&](std::uint32_t other) {
        if (is_free_[other] != 0) join_sets(cell, other, parent_of);
      });
    }
    std::uint32_t count = 0;
    for (const std::uint32_t cell : outermost_) {
      const std::uint32_t root = find_root(cell, parent_of);
      object_[cell] = root == cell ? count++ : object_[root];
    }
    return count;
  }

  /// Cells without an object join one that they touch, that with the smallest number.
  void grow() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;  // cell, object
    for (const std::uint32_t cell : outermost_) {
      for_neighbours(cell, [&](std::uint32_t other) {
        if (object_[other] == kNoObject) joined.emplace_back(other, object_[cell]);
      });
    }
    std::sort(joined.begin(), joined.end());
    outermost_.clear();
    for (const auto& [cell, object] : joined) {
      if (object_[cell] != kNoObject) continue;
      object_[cell] = object;
      outermost_.push_back(cell);
    }
  }

  [[nodiscard]] std::uint32_t object_of(std::uint32_t voxel) const {
    return object_[cell_of_[voxel]];
  }

 private:
  template <typename Visit>
  void for_neighbours(std::uint32_t cell, const Visit& visit) const {
    const VoxelIndex v = unpack(table_.key(cell));
    for (int i = 0; i < 27; ++i) {
      const std::uint32_t other =
          table_.find(pack({v.x + i % 3 - 1, v.y + i / 3 % 3 - 1, v.z + i / 9 - 1}));
      if (other != VoxelTable::kNone && other != cell) visit(other);
    }
  }

  VoxelTable table_;
  std::vector<std::uint32_t> cell_of_;    // by voxel
  std::vector<std::uint8_t> is_free_;     // whether a voxel in it is, by cell
  std::vector<std::uint32_t> object_;     // by cell
  std::vector<std::uint32_t> outermost_;  // cells that joined an object last
};

/// Counts of an object before it is known to be one.
struct Tally {
  std::uint32_t free = 0;
  std::uint32_t occupied = 0;
  Votes own;
  std::map<std::uint32_t, std::uint32_t> by_other;  ///< free voxels
  std::vector<std::uint32_t> members;

  void add(const ComparedVoxel& voxel) {
    free += voxel.presence == Presence::kFree ? 1 : 0;
    occupied += voxel.presence == Presence::kOccupied ? 1 : 0;
    if (voxel.presence == Presence::kFree) ++by_other[voxel.other];
    own.free += voxel.own.free;
    own.occupied += voxel.own.occupied;
  }
  [[nodiscard]] double share() const {
    return static_cast<double>(free) / static_cast<double>(free + occupied);
  }
  /// By the session it is of.
  [[nodiscard]] double seen_through() const {
    const std::uint32_t observations = own.free + own.occupied;
    return observations == 0 ? 0.0
                             : static_cast<double>(own.free) / static_cast<double>(observations);
  }
  [[nodiscard]] std::uint32_t main_other() const {
    return std::max_element(by_other.begin(), by_other.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }
};

bool is_object(const Tally& tally, const MapConfig& config) {
  if (tally.free < config.min_cluster) return false;
  if (tally.share() < kChangedShare) return false;
  // Half of it at least was confirmed from within range.
  if (2 * tally.own.occupied < tally.free) return false;
  return tally.seen_through() <= static_cast<double>(MapConfig::kObjectSeenThrough);
}

ObjectVoxels object_of(Tally& tally, const std::vector<ComparedVoxel>& voxels) {
  std::vector<Eigen::Vector3f> points;
  for (const std::uint32_t i : tally.members) points.push_back(voxels[i].position);
  ObjectVoxels found;
  found.object.free_in = tally.main_other();
  found.object.box = box_around(points);
  found.object.voxels = static_cast<std::uint32_t>(points.size());
  found.object.confidence = tally.share();
  found.object.seen_through = tally.seen_through();
  found.members = std::move(tally.members);
  return found;
}

bool have_same_size(const UprightBox& a, const UprightBox& b) {
  constexpr double kTolerance_m = 0.5;
  constexpr double kTolerance = 0.25;
  const auto sorted = [](const UprightBox& box) {
    return Eigen::Array3d(std::max(box.size.x(), box.size.y()),
                          std::min(box.size.x(), box.size.y()), box.size.z());
  };
  const Eigen::Array3d larger = sorted(a).max(sorted(b));
  return ((sorted(a) - sorted(b)).abs() <= (kTolerance * larger).min(kTolerance_m)).all();
}

/// Whether something could have been pushed from one box to the other.
bool are_beside(const UprightBox& a, const UprightBox& b) {
  constexpr double kFarthest_m = 2.0;
  return (a.centre - b.centre).norm() <= kFarthest_m;
}

/// The nearest of the objects that appeared which could be the one that is gone.
std::optional<std::uint32_t> moved_to(const ChangedObject& gone,
                                      const std::vector<ChangedObject>& objects) {
  const auto distance = [&](std::uint32_t i) {
    return (objects[i].box.centre - gone.box.centre).norm();
  };
  std::optional<std::uint32_t> nearest;
  for (std::uint32_t i = 0; i < objects.size(); ++i) {
    const ChangedObject& appeared = objects[i];
    if (appeared.kind != ChangeKind::kAppeared) continue;
    if (appeared.session != gone.free_in || appeared.free_in != gone.session) continue;
    if (!are_beside(appeared.box, gone.box) || !have_same_size(appeared.box, gone.box)) continue;
    if (!nearest || distance(i) < distance(*nearest)) nearest = i;
  }
  return nearest;
}

}  // namespace

void forget_small_groups(std::vector<ComparedVoxel>& voxels, const MapConfig& config) {
  std::vector<ComparedVoxel> free;
  for (const ComparedVoxel& voxel : voxels) {
    if (voxel.presence == Presence::kFree) free.push_back(voxel);
  }
  LinkCells cells(free);
  std::vector<std::uint32_t> count(cells.label(), 0);
  for (std::uint32_t i = 0; i < free.size(); ++i) ++count[cells.object_of(i)];
  std::uint32_t number = 0;
  for (ComparedVoxel& voxel : voxels) {
    if (voxel.presence != Presence::kFree) continue;
    if (count[cells.object_of(number++)] < config.min_cluster) voxel.presence = Presence::kUnknown;
  }
}

std::vector<ObjectVoxels> group_changes(const std::vector<ComparedVoxel>& voxels,
                                        const MapConfig& config) {
  LinkCells cells(voxels);
  std::vector<Tally> tallies(cells.label());
  for (std::uint32_t i = 0; i < voxels.size(); ++i) {
    if (cells.object_of(i) != kNoObject) tallies[cells.object_of(i)].add(voxels[i]);
  }
  for (int i = 0; i < kGrowth; ++i) cells.grow();
  for (std::uint32_t i = 0; i < voxels.size(); ++i) {
    if (cells.object_of(i) == kNoObject || voxels[i].presence == Presence::kOccupied) continue;
    tallies[cells.object_of(i)].members.push_back(i);
  }
  std::vector<ObjectVoxels> objects;
  for (Tally& tally : tallies) {
    if (!is_object(tally, config)) continue;
    ObjectVoxels found = object_of(tally, voxels);
    if (found.object.box.size.z() < static_cast<double>(config.min_object_height_m)) continue;
    objects.push_back(std::move(found));
  }
  return objects;
}

UprightBox box_around(const std::vector<Eigen::Vector3f>& points) {
  constexpr int kSteps = 45;
  UprightBox best;
  if (points.empty()) return best;
  // Relative to one of them, so that float does not lose millimetres kilometres away.
  const Eigen::Vector3d origin = points.front().cast<double>();
  double least = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kSteps; ++step) {
    UprightBox turned{origin, 0.5 * std::numbers::pi * step / kSteps, Eigen::Vector3d::Zero()};
    const Pose T_map_box = turned.pose();
    const Pose T_box_map = T_map_box.inverse();
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector3d high = -low;
    for (const Eigen::Vector3f& point : points) {
      const Eigen::Vector3d p = T_box_map * Eigen::Vector3d(point.cast<double>());
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    turned.size = high - low;
    // Nearly a line: its length decides.
    constexpr double kThin_m = 0.1;
    const double area = (turned.size.x() + kThin_m) * (turned.size.y() + kThin_m);
    if (area >= least) continue;
    least = area;
    turned.centre = T_map_box * Eigen::Vector3d(0.5 * (low + high));
    best = turned;
  }
  return best;
}

void pair_moved(std::vector<ChangedObject>& objects, std::vector<ChangedPoint>& points) {
  // Of each object the one it becomes a part of.
  std::vector<std::uint32_t> becomes(objects.size());
  std::iota(becomes.begin(), becomes.end(), 0U);
  for (std::uint32_t gone = 0; gone < objects.size(); ++gone) {
    if (objects[gone].kind != ChangeKind::kGone) continue;
    const std::optional<std::uint32_t> place = moved_to(objects[gone], objects);
    if (!place) continue;
    becomes[gone] = *place;
    ChangedObject& moved = objects[*place];
    moved.kind = ChangeKind::kMoved;
    moved.before = objects[gone].box;
    moved.voxels += objects[gone].voxels;
    moved.confidence = std::min(moved.confidence, objects[gone].confidence);
    moved.seen_through = std::max(moved.seen_through, objects[gone].seen_through);
  }
  std::vector<std::uint32_t> number(objects.size());
  std::uint32_t left = 0;
  for (std::uint32_t i = 0; i < objects.size(); ++i) {
    if (becomes[i] != i) continue;
    number[i] = left;
    if (left != i) objects[left] = std::move(objects[i]);
    ++left;
  }
  objects.resize(left);
  for (ChangedPoint& point : points) point.object = number[becomes[point.object]];
}

}  // namespace unimapper::merge
