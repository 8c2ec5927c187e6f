#include "src/apps/view/point_block.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>

namespace unimapper::apps {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kVersionWithIntensity = 2;
constexpr float kMostSteps = 65535.0F;

static_assert(std::endian::native == std::endian::little, "blocks are written in machine order");

template <typename T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

}  // namespace

bool has_intensity(std::span<const ViewPoint> points) {
  return std::any_of(points.begin(), points.end(),
                     [](const ViewPoint& point) { return point.intensity != 0; });
}

std::string point_block(std::span<const ViewPoint> points, const Eigen::Vector3f& origin,
                        float step_m) {
  const bool with_intensity = has_intensity(points);
  std::string bytes = "UMPT";
  bytes.reserve(28 + 9 * points.size());
  put(bytes, with_intensity ? kVersionWithIntensity : kVersion);
  put(bytes, static_cast<std::uint32_t>(points.size()));
  for (int axis = 0; axis < 3; ++axis) put(bytes, origin[axis]);
  put(bytes, step_m);
  for (int axis = 0; axis < 3; ++axis) {
    for (const ViewPoint& point : points) {
      const float steps = std::round((point.position[axis] - origin[axis]) / step_m);
      put(bytes, static_cast<std::uint16_t>(std::clamp(steps, 0.0F, kMostSteps)));
    }
  }
  for (const ViewPoint& point : points) put(bytes, point.session);
  for (const ViewPoint& point : points) put(bytes, point.category);
  if (!with_intensity) return bytes;
  for (const ViewPoint& point : points) put(bytes, point.intensity);
  return bytes;
}

std::string gzipped(std::string_view bytes) {
  constexpr int kGzip = 16 + MAX_WBITS;
  constexpr int kMemory = 8;
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  std::string out(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  // zlib's interface takes no const.
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

}  // namespace unimapper::apps
