#include "unimapper/place/structure_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace unimapper {
namespace {

// A cell's weight in fixed point: integer sums do not depend on the cells' order.
constexpr float kUnit = 256.0F;
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
  // The tails beyond three standard deviations carry nothing.
  const auto wanted = static_cast<std::int32_t>(std::ceil(3.0F * std::sqrt(variance)));
  kernel.radius = std::min({passes, wanted, SmoothingKernel::kMaxRadius});
  for (std::int32_t k = 0; k <= kernel.radius; ++k) kernel.weight[k] = weights[passes + k];
}

// Weighted sum of `count` consecutive values with their neighbours `stride` apart. Constant
// radius and block length let the compiler keep a block's sums in vector registers.
template <std::int32_t kRadius>
void convolve(const float* in, float* out, std::int32_t count, std::int32_t stride,
              const float* weight) noexcept {
  constexpr std::int32_t kBlock = 16;
  float w[kRadius + 1];
  for (std::int32_t k = 0; k <= kRadius; ++k) w[k] = weight[k];
  std::int32_t i = 0;
  for (; i + kBlock <= count; i += kBlock) {
    float sum[kBlock];
    for (std::int32_t j = 0; j < kBlock; ++j) sum[j] = w[0] * in[i + j];
    for (std::int32_t k = 1; k <= kRadius; ++k) {
      const float* before = in + i - k * stride;
      const float* after = in + i + k * stride;
      for (std::int32_t j = 0; j < kBlock; ++j) sum[j] += w[k] * (before[j] + after[j]);
    }
    for (std::int32_t j = 0; j < kBlock; ++j) out[i + j] = sum[j];
  }
  for (; i < count; ++i) {
    float sum = w[0] * in[i];
    for (std::int32_t k = 1; k <= kRadius; ++k) {
      sum += w[k] * (in[i - k * stride] + in[i + k * stride]);
    }
    out[i] = sum;
  }
}

using Convolution = void (*)(const float*, float*, std::int32_t, std::int32_t, const float*);
constexpr Convolution kConvolutions[SmoothingKernel::kMaxRadius + 1] = {
    convolve<0>, convolve<1>, convolve<2>, convolve<3>, convolve<4>, convolve<5>, convolve<6>};

}  // namespace

void StructureMap::attach(Arena& arena, const DescriptorConfig& config) noexcept {
  config_ = config;
  const auto half = static_cast<std::int32_t>(std::ceil(config.range_m / config.column_size_m)) + 2;
  width_ = 2 * half;
  half_extent_m_ = static_cast<float>(half) * config.column_size_m;
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  counts_ = arena.allocate<std::int32_t>(count);
  masks_ = arena.allocate<std::uint64_t>(count);
  height_ = arena.allocate<float>(count);
  xx_ = arena.allocate<float>(count);
  xy_ = arena.allocate<float>(count);
  yy_ = arena.allocate<float>(count);
  scratch_ = arena.allocate<float>(count);
  corners_.attach(arena, config.max_candidates);
  if (corners_.capacity() == 0 || scratch_ == nullptr) {
    width_ = 0;
    return;
  }
  make_kernel(config.smoothing_m, config.column_size_m, smoothing_kernel_);
  make_kernel(config.window_m, config.column_size_m, window_kernel_);
}

void StructureMap::build(std::span<const FineCell> cells, const LocalGround& ground) noexcept {
  corners_.clear();
  corners_.reset_refused();
  if (width_ == 0) return;
  splat(cells, ground);
  smooth(height_, smoothing_kernel_);
  corner_response();
  find_corners();
}

void StructureMap::splat(std::span<const FineCell> cells, const LocalGround& ground) noexcept {
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(width_);
  std::fill_n(counts_, count, 0);
  std::fill_n(masks_, count, std::uint64_t{0});
  const float inverse_step = 1.0F / config_.column_size_m;
  const auto limit = static_cast<float>(width_ - kMargin - 1);
  for (const FineCell& cell : cells) {
    if (cell.ground != 0) continue;
    const float above = cell.position.z() - ground.height(cell.position.x(), cell.position.y());
    if (!(above >= config_.min_height_m && above < 64.0F * kSliceHeight)) continue;
    // Columns are centred on the nodes of the grid.
    const float u = (cell.position.x() + half_extent_m_) * inverse_step;
    const float v = (cell.position.y() + half_extent_m_) * inverse_step;
    if (!(u >= kMargin && v >= kMargin && u < limit && v < limit)) continue;
    const auto column = static_cast<std::int32_t>(u);
    const auto row = static_cast<std::int32_t>(v);
    const auto fu = static_cast<std::int32_t>((u - static_cast<float>(column)) * 16.0F);
    const auto fv = static_cast<std::int32_t>((v - static_cast<float>(row)) * 16.0F);
    std::int32_t* at = counts_ + row * width_ + column;
    at[0] += (16 - fu) * (16 - fv);
    at[1] += fu * (16 - fv);
    at[width_] += (16 - fu) * fv;
    at[width_ + 1] += fu * fv;
    const auto slice = static_cast<std::uint32_t>(above / kSliceHeight);
    masks_[(row + (fv >= 8 ? 1 : 0)) * width_ + column + (fu >= 8 ? 1 : 0)] |= 1ULL << slice;
  }
  for (std::size_t i = 0; i < count; ++i) height_[i] = static_cast<float>(counts_[i]) / kUnit;
}

// Separable convolution. The outermost cells of the map, which are always empty, are the margin.
void StructureMap::smooth(float* field, const SmoothingKernel& kernel) noexcept {
  if (kernel.radius == 0) return;
  const Convolution apply = kConvolutions[kernel.radius];
  const std::int32_t inner = width_ - 2 * kMargin;
  for (std::int32_t row = 0; row < width_; ++row) {
    const std::int32_t at = row * width_ + kMargin;
    apply(field + at, scratch_ + at, inner, 1, kernel.weight);
  }
  for (std::int32_t row = kMargin; row < width_ - kMargin; ++row) {
    const std::int32_t at = row * width_ + kMargin;
    apply(scratch_ + at, field + at, inner, width_, kernel.weight);
  }
}

// The harmonic mean of the structure tensor's eigenvalues: zero along a straight wall, whatever
// its height, and large where the map changes in every direction. The map enters as it is: any
// compression of tall structure (root, logarithm) moves the corner of two walls into the room
// between them.
void StructureMap::corner_response() noexcept {
  const std::int32_t w = width_;
  const auto count = static_cast<std::size_t>(w) * static_cast<std::size_t>(w);
  std::fill_n(xx_, count, 0.0F);
  std::fill_n(xy_, count, 0.0F);
  std::fill_n(yy_, count, 0.0F);
  for (std::int32_t row = kMargin; row < w - kMargin; ++row) {
    for (std::int32_t i = row * w + kMargin; i < (row + 1) * w - kMargin; ++i) {
      const float gx = height_[i + 1] - height_[i - 1];
      const float gy = height_[i + w] - height_[i - w];
      xx_[i] = gx * gx;
      xy_[i] = gx * gy;
      yy_[i] = gy * gy;
    }
  }
  smooth(xx_, window_kernel_);
  smooth(xy_, window_kernel_);
  smooth(yy_, window_kernel_);
  constexpr float kQuiet = 1e-6F;
  for (std::size_t i = 0; i < count; ++i) {
    const float determinant = xx_[i] * yy_[i] - xy_[i] * xy_[i];
    xx_[i] = std::max(0.0F, determinant) / (xx_[i] + yy_[i] + kQuiet);
  }
}

void StructureMap::find_corners() noexcept {
  const std::int32_t w = width_;
  constexpr float kSilence = 1e-4F;
  for (std::int32_t row = kMargin; row < w - kMargin; ++row) {
    for (std::int32_t column = kMargin; column < w - kMargin; ++column) {
      const float* at = xx_ + row * w + column;
      const float r = at[0];
      // Strict on one side only, so that of two equal neighbours exactly one is the maximum.
      if (r <= kSilence || r <= at[-1] || r < at[1] || r <= at[-w] || r < at[w] ||
          r <= at[-w - 1] || r <= at[-w + 1] || r < at[w - 1] || r < at[w + 1]) {
        continue;
      }
      // The top of the parabola through the neighbours on each axis.
      const auto peak = [r](float before, float after) {
        const float curvature = before - 2.0F * r + after;
        if (!(curvature < 0.0F)) return 0.0F;
        return std::clamp(0.5F * (before - after) / curvature, -0.5F, 0.5F);
      };
      const float x = static_cast<float>(column) + peak(at[-1], at[1]);
      const float y = static_cast<float>(row) + peak(at[-w], at[w]);
      corners_.push_back({x * config_.column_size_m - half_extent_m_,
                          y * config_.column_size_m - half_extent_m_, r});
    }
  }
  std::sort(corners_.begin(), corners_.end(),
            [](const StructureCorner& a, const StructureCorner& b) {
              if (a.response != b.response) return a.response > b.response;
              return a.x != b.x ? a.x < b.x : a.y < b.y;
            });
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

}  // namespace unimapper
