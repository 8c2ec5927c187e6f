#include "structure_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

#include "cell_steps.hpp"

namespace unimapper::place {
namespace {

// A cell's weight in fixed point: integer sums do not depend on the cells' order.
constexpr float kUnit = 256.0F;
constexpr std::int32_t kPartBits = 4;
constexpr std::int32_t kParts = 1 << kPartBits;
// Structure lower than this above the local ground is ignored: kerbs, grass. Measured.
constexpr float kMinStructureHeightM = 0.3F;
// Binomial weights of a symmetric kernel, from its centre outwards; they approach a Gaussian and
// need no exponential function.
void make_kernel(float sigma_m, float step_m, SmoothingKernel& kernel) noexcept {
  constexpr std::int32_t kMaxPasses = 64;
  const float variance = sigma_m * sigma_m / (step_m * step_m);
  // One pass of (1 2 1)/4 has a variance of half a cell squared.
  const auto passes = std::min(static_cast<std::int32_t>(std::lround(2.0F * variance)), kMaxPasses);
  float weights[2 * kMaxPasses + 1] = {1.0F};
  for (std::int32_t n = 1; n <= 2 * passes; ++n) {
    for (std::int32_t k = n; k > 0; --k) weights[k] = 0.5F * (weights[k] + weights[k - 1]);
    weights[0] *= 0.5F;
  }
  // The tails beyond three standard deviations are negligible.
  const auto wanted = static_cast<std::int32_t>(std::ceil(3.0F * std::sqrt(variance)));
  kernel.radius = std::min({passes, wanted, SmoothingKernel::kMaxRadius});
  for (std::int32_t k = 0; k <= kernel.radius; ++k) kernel.weight[k] = weights[passes + k];
}

using Floats = float __attribute__((vector_size(16)));

Floats load(const float* from) noexcept {
  Floats floats;
  std::memcpy(&floats, from, sizeof floats);
  return floats;
}

// Weighted sum of each of a block's values with their neighbours `stride` apart. Constant radius
// lets the compiler keep a block's sums in two vector registers.
template <std::int32_t kRadius>
void convolve(const float* in, float* out, std::int32_t stride, const float* weight) noexcept {
  Floats low = weight[0] * load(in);
  Floats high = weight[0] * load(in + 4);
  for (std::int32_t k = 1; k <= kRadius; ++k) {
    const float* before = in - k * stride;
    const float* after = in + k * stride;
    low += weight[k] * (load(before) + load(after));
    high += weight[k] * (load(before + 4) + load(after + 4));
  }
  std::memcpy(out, &low, sizeof low);
  std::memcpy(out + 4, &high, sizeof high);
}

using Convolution = void (*)(const float*, float*, std::int32_t, const float*);
constexpr Convolution kConvolutions[SmoothingKernel::kMaxRadius + 1] = {
    convolve<0>, convolve<1>, convolve<2>, convolve<3>, convolve<4>, convolve<5>, convolve<6>};

}  // namespace

void StructureMap::allocate(Arena& arena, const DescriptorConfig& config) noexcept {
  config_ = config;
  const auto half = static_cast<std::int32_t>(std::ceil(config.range_m / config.column_size_m)) + 2;
  blocks_ = (2 * (half + kMargin) + kBlock - 1) / kBlock;
  width_ = blocks_ * kBlock;
  half_extent_m_ = static_cast<float>(width_ / 2) * config.column_size_m;
  const auto rows = static_cast<std::size_t>(width_);
  const std::size_t count = rows * rows;
  occupied_ = arena.allocate<std::uint8_t>(rows * static_cast<std::size_t>(blocks_));
  reach_ = arena.allocate<std::uint8_t>(rows * static_cast<std::size_t>(blocks_));
  counts_ = arena.allocate<std::int32_t>(count);
  masks_ = arena.allocate<std::uint64_t>(count);
  xx_ = arena.allocate<float>(count);
  xy_ = arena.allocate<float>(count);
  yy_ = arena.allocate<float>(count);
  scratch_ = arena.allocate<float>(count);
  corners_.allocate(arena, config.max_candidates);
  if (corners_.capacity() == 0 || scratch_ == nullptr) {
    width_ = 0;
    blocks_ = 0;
    return;
  }
  make_kernel(config.window_m, config.column_size_m, window_kernel_);
}

void StructureMap::begin() noexcept {
  corners_.clear();
  corners_.reset_refused();
  clear();
}

void StructureMap::run_pass(std::uint32_t pass, const Executor& executor) noexcept {
  if (width_ == 0) return;
  switch (pass) {
    case 0:
      mark_reach();
      return gradients(executor);
    case 1:
      return smooth(xx_, executor);
    case 2:
      return smooth(xy_, executor);
    case 3:
      return smooth(yy_, executor);
    case 4:
      return corner_response(executor);
    default:
      return find_corners(executor);
  }
}

// Calls `work(first)` for every block within reach of structure; `first` is the index of its first
// column. The margins above and below are never among them.
template <typename Work>
void StructureMap::for_each_block(const Executor& executor, const Work& work) const noexcept {
  constexpr std::uint32_t kRowsPerPart = 8;
  const Slice rows{kMargin, static_cast<std::uint32_t>(width_ - kMargin)};
  for_slices(executor, rows, kRowsPerPart, [&](Slice some, std::uint32_t) noexcept {
    for (auto row = static_cast<std::int32_t>(some.first); std::cmp_less(row, some.end); ++row) {
      const std::uint8_t* reached = reach_ + row * blocks_;
      for (std::int32_t block = 0; block < blocks_; ++block) {
        if (reached[block] != 0) work(row * width_ + block * kBlock);
      }
    }
  });
}

// Others may have used the memory.
void StructureMap::clear() noexcept {
  const std::int32_t count = width_ * width_;
  std::fill_n(counts_, count, 0);
  std::fill_n(masks_, count, std::uint64_t{0});
  for (float* field : {xx_, xy_, yy_, scratch_}) std::fill_n(field, count, 0.0F);
  std::fill_n(occupied_, width_ * blocks_, std::uint8_t{0});
}

void StructureMap::accumulate(std::span<const FineCell> structure,
                              const LocalGround& ground) noexcept {
  if (width_ == 0) return;
  // Columns are centred on the nodes of the grid; a cell is spread by sixteenths of a column.
  const float per_m = static_cast<float>(kParts) / config_.column_size_m;
  const CellSteps grid(per_m, half_extent_m_ * per_m);
  const std::int32_t last = width_ - kMargin - 2;
  for (const FineCell& cell : structure) {
    const float above = cell.position.z() - ground.height(cell.position.x(), cell.position.y());
    if (!(above >= kMinStructureHeightM && above < 64.0F * kSliceHeight)) continue;
    const CellSteps::Steps steps = grid.of(cell);
    const std::int32_t column = steps.x >> kPartBits;
    const std::int32_t row = steps.y >> kPartBits;
    if (column < kMargin || row < kMargin || column > last || row > last) continue;
    const std::int32_t fu = steps.x & (kParts - 1);
    const std::int32_t fv = steps.y & (kParts - 1);
    std::int32_t* at = counts_ + row * width_ + column;
    at[0] += (kParts - fu) * (kParts - fv);
    at[1] += fu * (kParts - fv);
    at[width_] += (kParts - fu) * fv;
    at[width_ + 1] += fu * fv;
    const auto slice = static_cast<std::uint32_t>(above / kSliceHeight);
    masks_[(row + (fv >= kParts / 2 ? 1 : 0)) * width_ + column + (fu >= kParts / 2 ? 1 : 0)] |=
        1ULL << slice;
    occupied_[row * blocks_ + column / kBlock] = 1;
  }
}

// Structure is spread over two columns and two rows, and gradients reach one farther. Kernels reach
// farther still, but no corner is searched for where no structure is near; sideways a block is wide
// enough for them.
void StructureMap::mark_reach() noexcept {
  std::fill_n(reach_, width_ * blocks_, std::uint8_t{0});
  static_assert(kBlock > SmoothingKernel::kMaxRadius + 1);
  constexpr std::int32_t kAbove = 3;
  for (std::int32_t row = 0; row < width_; ++row) {
    for (std::int32_t block = 0; block < blocks_; ++block) {
      if (occupied_[row * blocks_ + block] == 0) continue;
      const std::int32_t first = std::max(0, block - 1);
      const std::int32_t count = std::min(blocks_ - 1, block + 1) - first + 1;
      const std::int32_t last_row = std::min(width_ - 1, row + kAbove);
      for (std::int32_t y = std::max(0, row - kAbove + 1); y <= last_row; ++y) {
        std::fill_n(reach_ + y * blocks_ + first, count, std::uint8_t{1});
      }
    }
  }
}

// The map enters as it is, neither smoothed nor compressed: smoothing moves corners (repeatability
// 0.35 -> 0.44 without), and any compression of tall structure (root, logarithm) moves the corner
// of two walls into the space between them.
void StructureMap::gradients(const Executor& executor) noexcept {
  const std::int32_t w = width_;
  for_each_block(executor, [&](std::int32_t first) {
    for (std::int32_t i = first; i < first + kBlock; ++i) {
      const float gx = static_cast<float>(counts_[i + 1] - counts_[i - 1]) / kUnit;
      const float gy = static_cast<float>(counts_[i + w] - counts_[i - w]) / kUnit;
      xx_[i] = gx * gx;
      xy_[i] = gx * gy;
      yy_[i] = gy * gy;
    }
  });
}

// Separable convolution. Whatever is not zero lies within the blocks reached.
void StructureMap::smooth(float* field, const Executor& executor) noexcept {
  const Convolution apply = kConvolutions[window_kernel_.radius];
  const float* const weight = window_kernel_.weight;
  float* const scratch = scratch_;
  const std::int32_t w = width_;
  for_each_block(executor,
                 [=](std::int32_t first) { apply(field + first, scratch + first, 1, weight); });
  for_each_block(executor,
                 [=](std::int32_t first) { apply(scratch + first, field + first, w, weight); });
}

// The harmonic mean of the structure tensor's eigenvalues: zero along a straight wall, whatever
// its height, and large where the map changes in every direction.
void StructureMap::corner_response(const Executor& executor) noexcept {
  constexpr float kEpsilon = 1e-6F;
  for_each_block(executor, [&](std::int32_t first) {
    for (std::int32_t i = first; i < first + kBlock; ++i) {
      const float determinant = xx_[i] * yy_[i] - xy_[i] * xy_[i];
      xx_[i] = std::max(0.0F, determinant) / (xx_[i] + yy_[i] + kEpsilon);
    }
  });
}

// Of more maxima than there is room for, the first ones by row and column are kept: those of each
// block are noted before any is added.
void StructureMap::find_corners(const Executor& executor) noexcept {
  std::uint8_t* const maxima = occupied_;
  for_each_block(executor, [&](std::int32_t first) {
    std::uint32_t found = 0;
    for (std::int32_t j = 0; j < kBlock; ++j) {
      if (is_maximum(first + j)) found |= 1U << j;
    }
    maxima[first / kBlock] = static_cast<std::uint8_t>(found);
  });
  for_each_block({}, [&](std::int32_t first) {
    for (std::uint32_t left = maxima[first / kBlock]; left != 0; left &= left - 1) {
      add_corner(first + std::countr_zero(left));
    }
  });
  std::sort(corners_.begin(), corners_.end(),
            [](const StructureCorner& a, const StructureCorner& b) {
              if (a.response != b.response) return a.response > b.response;
              return a.x != b.x ? a.x < b.x : a.y < b.y;
            });
}

bool StructureMap::is_maximum(std::int32_t column) const noexcept {
  constexpr float kMinResponse = 1e-4F;
  const std::int32_t w = width_;
  const float* at = xx_ + column;
  const float r = at[0];
  // Strict on one side only, so that of two equal neighbours exactly one is the maximum.
  return !(r <= kMinResponse || r <= at[-1] || r < at[1] || r <= at[-w] || r < at[w] ||
           r <= at[-w - 1] || r <= at[-w + 1] || r < at[w - 1] || r < at[w + 1]);
}

void StructureMap::add_corner(std::int32_t column) noexcept {
  const std::int32_t w = width_;
  const float* at = xx_ + column;
  const float r = at[0];
  // The top of the parabola through the neighbours on each axis.
  const auto peak = [r](float before, float after) {
    const float curvature = before - 2.0F * r + after;
    if (!(curvature < 0.0F)) return 0.0F;
    return std::clamp(0.5F * (before - after) / curvature, -0.5F, 0.5F);
  };
  const float x = static_cast<float>(column % w) + peak(at[-1], at[1]);
  const float y = static_cast<float>(column / w) + peak(at[-w], at[w]);
  corners_.push_back(
      {x * config_.column_size_m - half_extent_m_, y * config_.column_size_m - half_extent_m_, r});
}

std::uint64_t StructureMap::occupancy(float x, float y) const noexcept {
  if (width_ == 0) return 0;
  const float step = config_.column_size_m;
  const auto reach = static_cast<std::int32_t>(kCodeRadius / step) + 1;
  const auto column = static_cast<std::int32_t>((x + half_extent_m_) / step + 0.5F);
  const auto row = static_cast<std::int32_t>((y + half_extent_m_) / step + 0.5F);
  std::uint64_t mask = 0;
  for (std::int32_t j = std::max(0, row - reach); j <= std::min(width_ - 1, row + reach); ++j) {
    for (std::int32_t i = std::max(0, column - reach); i <= std::min(width_ - 1, column + reach);
         ++i) {
      const float dx = static_cast<float>(i) * step - half_extent_m_ - x;
      const float dy = static_cast<float>(j) * step - half_extent_m_ - y;
      if (dx * dx + dy * dy <= kCodeRadius * kCodeRadius) mask |= masks_[j * width_ + i];
    }
  }
  return mask;
}

}  // namespace unimapper::place
