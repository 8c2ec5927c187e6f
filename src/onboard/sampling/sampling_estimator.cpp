#include "sampling_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "src/core/quantile.hpp"
#include "unimapper/core/angles.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/core/vector_width.hpp"

namespace unimapper::onboard {
namespace {

constexpr std::size_t kBatch = 256;
constexpr RangeImageShape kCells{360.0F, 6.0F, -90.0F, 90.0F, 15.0F};
constexpr std::uint32_t kFewestPerPatch = 16;
/// Rings closer than this are one: no spinning sensor has such.
constexpr float kRingApart_deg = 0.06F;
constexpr std::uint32_t kFewestPerRing = 3;
/// Second returns of a ray, and gaps where something returned nothing.
constexpr float kLeastGap_deg = 0.03F;
constexpr float kMostGap_deg = 8.0F;
constexpr std::uint32_t kFewestAlong = 100;
constexpr std::uint32_t kFewestAcross = 12;
constexpr float kLeastAgreement = 0.4F;
/// An axis replaces a simpler one only where rings concentrate by so much more.
constexpr float kBetter = 1.1F;

float degrees(float turns) noexcept { return 360.0F * turns; }

float elevation_deg(const Eigen::Vector3f& direction, const Eigen::Vector3f& axis) noexcept {
  const float sine = direction.dot(axis);
  return degrees(direction_turns(std::sqrt(std::max(1.0F - sine * sine, 0.0F)), sine));
}

/// How much the values of a histogram concentrate: the mean fill of the bin that a value is in.
/// What lies in none is counted behind the last one.
class Concentration {
 public:
  Concentration(std::uint32_t* bins, std::uint32_t count) noexcept : bins_(bins), count_(count) {
    std::fill_n(bins_, count_ + 1, 0U);
  }
  /// Bin of a value, out of so many. Without branches, so that loops over it vectorise.
  [[nodiscard]] static std::int32_t bin_of(float value_deg, float bins) noexcept {
    constexpr float kPerDegree = 20.0F;
    const float at = value_deg * kPerDegree + 0.5F * bins;
    const float from_below = at >= 0.0F ? at : bins;
    return static_cast<std::int32_t>(from_below < bins ? from_below : bins);
  }
  void add(std::int32_t bin) noexcept { ++bins_[bin]; }
  [[nodiscard]] float value() const noexcept {
    std::uint32_t squares = 0;
    std::uint32_t values = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      squares += bins_[i] * bins_[i];
      values += bins_[i];
    }
    return values == 0 ? 0.0F : static_cast<float>(squares) / static_cast<float>(values);
  }

 private:
  std::uint32_t* bins_;
  std::uint32_t count_;
};

}  // namespace

void SamplingEstimator::allocate(Arena& arena) noexcept {
  grid_ = ImageProjection(kCells);
  cell_points_ = arena.allocate<std::uint32_t>(grid_.pixels());
  patch_of_ = arena.allocate<std::uint8_t>(grid_.pixels());
  sines_ = arena.allocate<std::uint32_t>(kSineBins);
  bins_ = arena.allocate<std::uint32_t>(kBins + 1);
  scores_ = arena.allocate<float>(std::size_t{kPatches} * kSlopes);
  patches_ = arena.allocate<Patch>(kPatches);
  along_.values_deg = arena.allocate<float>(kGaps);
  across_.values_deg = arena.allocate<float>(kGaps);
}

Eigen::Vector3f SamplingEstimator::Axis::direction() const noexcept {
  constexpr auto kPerDegree = static_cast<float>(1.0 / kDegreesPerRadian);
  return Eigen::Vector3f(x_deg * kPerDegree, y_deg * kPerDegree, 1.0F).normalized();
}

Eigen::Vector3f SamplingEstimator::Patch::center() const noexcept {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::uint32_t i = 0; i < size; ++i) sum += rays[i].direction;
  return sum.normalized();
}

float SamplingEstimator::Gaps::median(float& share) noexcept {
  share = 0.0F;
  if (size == 0) return 0.0F;
  const float middle = unimapper::median(std::span(values_deg, size));
  std::uint32_t near = 0;
  for (std::uint32_t i = 0; i < size; ++i) {
    const float off = values_deg[i] - middle;
    near += (off < 0.0F ? -off : off) <= 0.25F * middle ? 1U : 0U;
  }
  share = static_cast<float>(near) / static_cast<float>(size);
  return middle;
}

void SamplingEstimator::begin() noexcept {
  estimate_ = {};
  rays_ = 0;
  std::fill_n(cell_points_, grid_.pixels(), 0U);
  std::fill_n(sines_, kSineBins, 0U);
  along_.size = across_.size = 0;
  loop_.begin();
  task_ = Task::kCount;
}

bool SamplingEstimator::step(const PointView& points, float range_min_m,
                             float range_max_m) noexcept {
  constexpr std::uint32_t kPointsPerStep = 65536;
  constexpr std::uint32_t kMostPatches = 8;
  constexpr std::uint32_t kAxes = 25;
  constexpr std::uint32_t kMostAxes = 9;
  const auto next_points = [&]() noexcept {
    const Slice some = loop_.next(static_cast<std::uint32_t>(points.count), kPointsPerStep);
    PointView part = points;
    part.data += some.first * points.stride;
    part.count = some.end - some.first;
    return part;
  };
  switch (task_) {
    case Task::kCount:
      count(next_points(), range_min_m, range_max_m);
      if (!loop_.is_over()) break;
      find_elevations();
      choose_patches();
      break;
    case Task::kCollect:
      collect(next_points(), range_min_m, range_max_m);
      break;
    case Task::kSlopes: {
      const Slice some = loop_.next(patch_count_, kMostPatches);
      for (std::uint32_t p = some.first; p < some.end; ++p) {
        score_slopes(patches_[p], scores_ + std::size_t{p} * kSlopes);
      }
      break;
    }
    case Task::kAxis:
      find_axis();
      break;
    case Task::kRestOfAxis: {
      const Slice some = loop_.next(kAxes, kMostAxes);
      for (std::uint32_t i = some.first; i < some.end; ++i) try_axis(i);
      break;
    }
    case Task::kGaps: {
      const Slice some = loop_.next(patch_count_, kMostPatches);
      for (std::uint32_t p = some.first; p < some.end; ++p) add_gaps(patches_[p], axis_);
      break;
    }
    case Task::kDone:
      return false;
  }
  if (!loop_.is_over()) return true;
  loop_.begin();
  task_ = static_cast<Task>(static_cast<std::uint8_t>(task_) + 1U);
  if (task_ > Task::kCollect && patch_count_ == 0) task_ = Task::kDone;
  if (task_ == Task::kDone) conclude();
  return task_ != Task::kDone;
}

void SamplingEstimator::conclude() noexcept {
  float along_share = 0.0F;
  float across_share = 0.0F;
  const Sampling sampling{along_.median(along_share), across_.median(across_share)};
  estimate_.valid = along_.size >= kFewestAlong && across_.size >= kFewestAcross &&
                    along_share >= kLeastAgreement && across_share >= kLeastAgreement;
  if (estimate_.valid) estimate_.sampling = sampling;
}

template <typename Visit>
void SamplingEstimator::for_each_ray(const PointView& points, float range_min_m, float range_max_m,
                                     const Visit& visit) const noexcept {
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  float range_m[kBatch];
  std::int32_t cell[kBatch];
  for (std::size_t first = 0; first < points.count; first += kBatch) {
    const std::size_t size = std::min(kBatch, points.count - first);
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector3f p = points[first + i];
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
    grid_.project(x, y, z, size, cell, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      if (cell[i] == ImageProjection::kOutside) continue;
      // False for NaN and infinity.
      if (!(range_m[i] >= range_min_m && range_m[i] <= range_max_m && range_m[i] > 0.0F)) continue;
      visit(Eigen::Vector3f(x[i], y[i], z[i]), range_m[i], static_cast<std::uint32_t>(cell[i]));
    }
  }
}

void SamplingEstimator::count(const PointView& points, float range_min_m,
                              float range_max_m) noexcept {
  for_each_ray(points, range_min_m, range_max_m,
               [&](const Eigen::Vector3f& p, float range_m, std::uint32_t cell) noexcept {
                 ++cell_points_[cell];
                 const float sine = p.z() / range_m;
                 const float bin = (sine + 1.0F) * (0.5F * static_cast<float>(kSineBins));
                 ++sines_[std::min(static_cast<std::uint32_t>(bin), kSineBins - 1)];
                 ++rays_;
               });
}

void SamplingEstimator::find_elevations() noexcept {
  if (rays_ == 0) return;
  const std::uint32_t left_out = rays_ / 200;
  std::uint32_t low = 0;
  for (std::uint32_t sum = sines_[0]; sum <= left_out;) sum += sines_[++low];
  std::uint32_t high = kSineBins - 1;
  for (std::uint32_t sum = sines_[high]; sum <= left_out;) sum += sines_[--high];
  const auto edge_deg = [](std::uint32_t bin) noexcept {
    const float sine = 2.0F * static_cast<float>(bin) / static_cast<float>(kSineBins) - 1.0F;
    return degrees(direction_turns(std::sqrt(std::max(1.0F - sine * sine, 0.0F)), sine));
  };
  estimate_.elevation_min_deg = edge_deg(low);
  estimate_.elevation_max_deg = edge_deg(high + 1);
}

void SamplingEstimator::choose_patches() noexcept {
  // The fullest cell of columns all around.
  std::fill_n(patch_of_, grid_.pixels(), kNoPatch);
  patch_count_ = 0;
  const auto columns = static_cast<std::uint32_t>(grid_.columns());
  const auto rows = static_cast<std::uint32_t>(grid_.rows());
  for (std::uint32_t i = 0; i < kPatches; ++i) {
    std::uint32_t fullest = 0;
    std::uint32_t most = 0;
    for (std::uint32_t column = i * columns / kPatches; column < (i + 1) * columns / kPatches;
         ++column) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        const std::uint32_t cell = row * columns + column;
        if (cell_points_[cell] <= most) continue;
        most = cell_points_[cell];
        fullest = cell;
      }
    }
    if (most < kFewestPerPatch) continue;
    patches_[patch_count_].size = 0;
    patch_of_[fullest] = static_cast<std::uint8_t>(patch_count_++);
  }
}

void SamplingEstimator::collect(const PointView& points, float range_min_m,
                                float range_max_m) noexcept {
  for_each_ray(points, range_min_m, range_max_m,
               [&](const Eigen::Vector3f& p, float range_m, std::uint32_t cell) noexcept {
                 const std::uint8_t patch = patch_of_[cell];
                 if (patch == kNoPatch) return;
                 Patch& into = patches_[patch];
                 if (into.size == kPatchPoints) return;
                 into.rays[into.size++] = {p / range_m, 0.0F, 0.0F};
               });
}

void SamplingEstimator::score_slopes(const Patch& patch, float* scores) noexcept {
  const Eigen::Vector3f center = patch.center();
  const Eigen::Vector3f left = Eigen::Vector3f(-center.y(), center.x(), 0.0F).normalized();
  const Eigen::Vector3f up = center.cross(left);
  float x[kPatchPoints];
  float y[kPatchPoints];
  float z[kPatchPoints];
  std::int32_t bin[kPatchPoints];
  for (std::uint32_t i = 0; i < patch.size; ++i) {
    x[i] = patch.rays[i].direction.x();
    y[i] = patch.rays[i].direction.y();
    z[i] = patch.rays[i].direction.z();
  }
  const VectorWidth width = widest_vectors();
  for (std::uint32_t k = 0; k < kSlopes; ++k) {
    const auto slope_deg = static_cast<double>(static_cast<std::int32_t>(k) - kMaxSlope_deg);
    const Eigen::Vector3f across =
        static_cast<float>(cos_deg(slope_deg)) * up - static_cast<float>(sin_deg(slope_deg)) * left;
    run_vectorised(width, [&]() UNIMAPPER_VECTORISED {
      constexpr auto kPerRadian = static_cast<float>(kDegreesPerRadian);
      const std::uint32_t size = patch.size;
      const float ax = across.x();
      const float ay = across.y();
      const float az = across.z();
      for (std::uint32_t i = 0; i < size; ++i) {
        const float sine = x[i] * ax + (y[i] * ay + z[i] * az);
        bin[i] = Concentration::bin_of(kPerRadian * sine, static_cast<float>(kBins));
      }
    });
    Concentration rings(bins_, kBins);
    for (std::uint32_t i = 0; i < patch.size; ++i) rings.add(bin[i]);
    scores[k] = rings.value();
  }
}

void SamplingEstimator::find_axis() noexcept {
  constexpr std::int32_t kMostTilt_deg = 24;
  Eigen::Vector3f left[kPatches];
  Eigen::Vector3f up[kPatches];
  for (std::uint32_t p = 0; p < patch_count_; ++p) {
    const Eigen::Vector3f center = patches_[p].center();
    left[p] = Eigen::Vector3f(-center.y(), center.x(), 0.0F).normalized();
    up[p] = center.cross(left[p]);
  }
  const auto sum = [&](const Axis& axis) noexcept {
    const Eigen::Vector3f a = axis.direction();
    float total = 0.0F;
    for (std::uint32_t p = 0; p < patch_count_; ++p) {
      // Rings run along a x d.
      const float slope_deg = degrees(direction_turns(a.dot(up[p]), -a.dot(left[p])));
      const auto k = static_cast<std::int32_t>(slope_deg + 1000.5F) - 1000 + kMaxSlope_deg;
      if (k < 0 || k >= static_cast<std::int32_t>(kSlopes)) continue;
      total += scores_[std::size_t{p} * kSlopes + static_cast<std::size_t>(k)];
    }
    return total;
  };
  Axis best;
  float most = kBetter * sum(best);
  for (std::int32_t x = -kMostTilt_deg; x <= kMostTilt_deg; ++x) {
    for (std::int32_t y = -kMostTilt_deg; y <= kMostTilt_deg; ++y) {
      const Axis axis{static_cast<float>(x), static_cast<float>(y)};
      const float total = sum(axis);
      if (total <= most) continue;
      most = total;
      best = axis;
    }
  }
  coarse_ = axis_ = best;
  axis_score_ = kBetter * score(best);
}

void SamplingEstimator::try_axis(std::uint32_t i) noexcept {
  // The rest of a degree.
  const auto steps = [](std::uint32_t count) noexcept {
    return 0.3F * (static_cast<float>(count) - 2.0F);
  };
  const Axis axis{coarse_.x_deg + steps(i / 5), coarse_.y_deg + steps(i % 5)};
  const float total = score(axis);
  if (total <= axis_score_) return;
  axis_score_ = total;
  axis_ = axis;
}

float SamplingEstimator::score(const Axis& axis) noexcept {
  constexpr std::uint32_t kMost = 256;
  const Eigen::Vector3f a = axis.direction();
  float total = 0.0F;
  for (std::uint32_t p = 0; p < patch_count_; ++p) {
    const Patch& patch = patches_[p];
    const float middle_deg = elevation_deg(patch.center(), a);
    Concentration rings(bins_, kBins);
    for (std::uint32_t i = 0; i < std::min(patch.size, kMost); ++i) {
      const float above_deg = elevation_deg(patch.rays[i].direction, a) - middle_deg;
      rings.add(Concentration::bin_of(above_deg, static_cast<float>(kBins)));
    }
    total += rings.value();
  }
  return total;
}

void SamplingEstimator::add_gaps(Patch& patch, const Axis& axis) noexcept {
  const Eigen::Vector3f up = axis.direction();
  const Eigen::Vector3f ahead = (patch.center() - up * up.dot(patch.center())).normalized();
  const Eigen::Vector3f left = up.cross(ahead);
  for (std::uint32_t i = 0; i < patch.size; ++i) {
    Ray& ray = patch.rays[i];
    ray.azimuth_deg = degrees(direction_turns(ray.direction.dot(ahead), ray.direction.dot(left)));
    ray.elevation_deg = elevation_deg(ray.direction, up);
  }
  std::sort(patch.rays, patch.rays + patch.size, [](const Ray& a, const Ray& b) noexcept {
    return a.elevation_deg < b.elevation_deg ||
           (a.elevation_deg == b.elevation_deg && a.azimuth_deg < b.azimuth_deg);
  });
  const auto end_of_ring = [&patch](std::uint32_t first) noexcept {
    std::uint32_t end = first + 1;
    while (end < patch.size &&
           patch.rays[end].elevation_deg - patch.rays[end - 1].elevation_deg < kRingApart_deg) {
      ++end;
    }
    return end;
  };
  std::uint32_t largest = 0;
  for (std::uint32_t first = 0, end = 0; first < patch.size; first = end) {
    end = end_of_ring(first);
    largest = std::max(largest, end - first);
  }
  bool has_ring_below = false;
  float below_deg = 0.0F;
  for (std::uint32_t first = 0, end = 0; first < patch.size; first = end) {
    end = end_of_ring(first);
    const std::uint32_t count = end - first;
    float sum_deg = 0.0F;
    for (std::uint32_t i = first; i < end; ++i) {
      sum_deg += patch.rays[i].elevation_deg - patch.rays[first].elevation_deg;
    }
    const float mean_deg = patch.rays[first].elevation_deg + sum_deg / static_cast<float>(count);
    const bool is_ring = count >= std::max(kFewestPerRing, largest / 3);
    if (is_ring && has_ring_below && mean_deg - below_deg <= kMostGap_deg) {
      across_.add(mean_deg - below_deg);
    }
    if (is_ring) {
      std::sort(patch.rays + first, patch.rays + end,
                [](const Ray& a, const Ray& b) noexcept { return a.azimuth_deg < b.azimuth_deg; });
      add_ring(patch.rays + first, count);
    }
    // A ring that was hardly seen, or a piece of one: the gap beyond it is not known.
    has_ring_below = is_ring;
    below_deg = mean_deg;
  }
}

void SamplingEstimator::add_ring(Ray* rays, std::uint32_t count) noexcept {
  // Both returns of a ray may be one point, published twice.
  const Ray* const end = std::unique(rays, rays + count, [](const Ray& a, const Ray& b) noexcept {
    return a.azimuth_deg == b.azimuth_deg;
  });
  count = static_cast<std::uint32_t>(end - rays);
  for (std::uint32_t i = 1; i + 1 < count; ++i) {
    const float before = rays[i].azimuth_deg - rays[i - 1].azimuth_deg;
    const float after = rays[i + 1].azimuth_deg - rays[i].azimuth_deg;
    const float nearest = std::min(before, after);
    if (nearest >= kLeastGap_deg && nearest <= kMostGap_deg) along_.add(nearest);
  }
}

}  // namespace unimapper::onboard
