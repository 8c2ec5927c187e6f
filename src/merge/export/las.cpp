// LAS files, by the ASPRS LAS 1.4 specification (revision 15).
#include "src/merge/export/las.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "export_files.hpp"
#include "src/merge/graph/site_origin.hpp"
#include "src/merge/map/unified_map.hpp"

namespace unimapper::merge {
namespace {

static_assert(std::endian::native == std::endian::little, "LAS is written in machine order");

constexpr double kScaleM = 0.001;
constexpr std::uint16_t kHeaderBytes = 375;
constexpr std::uint16_t kRecordHeaderBytes = 54;
constexpr std::uint8_t kPointFormat = 6;
constexpr std::uint16_t kPointBytes = 30;
constexpr std::uint8_t kUnclassified = 1;
constexpr std::uint8_t kGround = 2;

/// Numbers and texts of fixed length, one after the other.
class Bytes {
 public:
  template <typename T>
  void put(const T& value) {
    const std::size_t at = all_.size();
    all_.resize(at + sizeof(T));
    std::memcpy(all_.data() + at, &value, sizeof(T));
  }
  void put_text(std::string_view text, std::size_t length) {
    all_.append(text.substr(0, length));
    all_.append(length - std::min(length, text.size()), '\0');
  }
  void put_zeros(std::size_t count) { all_.append(count, '\0'); }
  [[nodiscard]] std::size_t size() const { return all_.size(); }
  void write_to(OutputFile& file) {
    file.stream().write(all_.data(), static_cast<std::streamsize>(all_.size()));
    all_.clear();
  }

 private:
  std::string all_;
};

/// What the header says of the points.
struct Extent {
  std::uint64_t points = 0;
  std::array<std::int32_t, 3> low{};
  std::array<std::int32_t, 3> high{};

  void add(const std::array<std::int32_t, 3>& point) {
    if (points++ == 0) low = high = point;
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], point[i]);
      high[i] = std::max(high[i], point[i]);
    }
  }
};

void put_date(Bytes& bytes, std::int64_t stamp_ns) {
  namespace chrono = std::chrono;
  const chrono::sys_days day(
      chrono::floor<chrono::days>(chrono::nanoseconds(std::max<std::int64_t>(stamp_ns, 0))));
  const chrono::year year = chrono::year_month_day(day).year();
  const chrono::sys_days first = year / chrono::January / 1;
  bytes.put(static_cast<std::uint16_t>((day - first).count() + 1));
  bytes.put(static_cast<std::uint16_t>(static_cast<int>(year)));
}

/// The WKT record and its final zero.
std::size_t record_bytes(const LasFrame& frame) {
  return frame.wkt.empty() ? 0 : kRecordHeaderBytes + frame.wkt.size() + 1;
}

Bytes header(const LasFrame& frame, const Extent& extent) {
  constexpr std::uint16_t kWktBit = 1U << 4U;  // point formats from 6 on have it in any case
  Bytes bytes;
  bytes.put_text("LASF", 4);
  bytes.put(std::uint16_t{0});  // file source: none
  bytes.put(kWktBit);
  bytes.put_zeros(16);  // no GUID
  bytes.put(std::uint8_t{1});
  bytes.put(std::uint8_t{4});
  bytes.put_text("OTHER", 32);
  bytes.put_text("Uni-Mapper", 32);
  put_date(bytes, frame.stamp_ns);
  bytes.put(kHeaderBytes);
  bytes.put(static_cast<std::uint32_t>(kHeaderBytes + record_bytes(frame)));
  bytes.put(std::uint32_t{frame.wkt.empty() ? 0U : 1U});
  bytes.put(kPointFormat);
  bytes.put(kPointBytes);
  bytes.put_zeros(4 + 5 * 4);  // counts of older versions, which this format must leave 0
  for (int i = 0; i < 3; ++i) bytes.put(kScaleM);
  for (int i = 0; i < 3; ++i) bytes.put(frame.offset[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::int32_t face : {extent.high[i], extent.low[i]}) {
      bytes.put(face * kScaleM + frame.offset[static_cast<Eigen::Index>(i)]);
    }
  }
  bytes.put_zeros(8 + 8 + 4);  // no waveforms, no extended records
  bytes.put(extent.points);
  bytes.put(extent.points);  // each is the only return of its ray
  bytes.put_zeros(14 * 8);
  return bytes;
}

void put_wkt(Bytes& bytes, const LasFrame& frame) {
  if (frame.wkt.empty()) return;
  bytes.put(std::uint16_t{0});
  bytes.put_text("LASF_Projection", 16);
  bytes.put(std::uint16_t{2112});
  bytes.put(static_cast<std::uint16_t>(frame.wkt.size() + 1));
  bytes.put_text("OGC coordinate system WKT", 32);
  bytes.put_text(frame.wkt, frame.wkt.size() + 1);
}

/// Millimetres from the offset.
std::array<std::int32_t, 3> scaled(const std::filesystem::path& path, const MapPoint& point) {
  std::array<std::int32_t, 3> result;
  for (int i = 0; i < 3; ++i) {
    const double value = std::round(static_cast<double>(point.position[i]) / kScaleM);
    if (!(std::abs(value) <= std::numeric_limits<std::int32_t>::max())) {
      throw std::runtime_error(path.string() +
                               ": a point is not finite or more than 2147 km from the offset");
    }
    result[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(value);
  }
  return result;
}

void put_point(Bytes& bytes, const std::array<std::int32_t, 3>& position, const MapPoint& point) {
  constexpr std::uint8_t kOnlyReturn = 0x11;  // first of one
  for (const std::int32_t axis : position) bytes.put(axis);
  bytes.put(static_cast<std::uint16_t>(point.intensity * 257U));  // 255 becomes 65535
  bytes.put(kOnlyReturn);
  bytes.put(std::uint8_t{0});
  bytes.put(point.is_ground ? kGround : kUnclassified);
  bytes.put(static_cast<std::uint8_t>(std::min<std::uint32_t>(point.sessions_seen, 255U)));
  bytes.put(std::int16_t{0});  // scan angle
  bytes.put(static_cast<std::uint16_t>(point.session + 1));
  bytes.put(0.0);  // time: a point is the mean of many
}

}  // namespace

Eigen::Vector3d map_offset(const std::vector<SessionData>& sessions, const MergeResult& result) {
  if (result.georeference) return result.georeference->origin;
  if (result.central_session >= sessions.size()) return Eigen::Vector3d::Zero();
  return odometry_origin(sessions[result.central_session]);
}

std::int64_t last_stamp_ns(std::span<const SessionData> sessions) {
  std::int64_t last_ns = 0;
  for (const SessionData& session : sessions) {
    for (const KeyframeRecord& keyframe : session.keyframes) {
      if (!keyframe.scans.empty()) last_ns = std::max(last_ns, keyframe.scans.back().stamp_ns);
    }
  }
  return last_ns;
}

void write_las(const std::filesystem::path& path, const ExternalVector<MapPoint>& points,
               const LasFrame& frame) {
  constexpr std::size_t kBlockBytes = std::size_t{1} << 20U;
  if (frame.wkt.size() >= std::numeric_limits<std::uint16_t>::max()) {
    throw std::runtime_error(path.string() + ": the coordinate system's text is too long for LAS");
  }
  OutputFile file(path);
  Extent extent;
  Bytes bytes = header(frame, extent);
  put_wkt(bytes, frame);
  for (const MapPoint& point : points) {
    if (!std::in_range<std::uint16_t>(std::uint64_t{point.session} + 1)) {
      throw std::runtime_error(path.string() + ": LAS cannot number more than 65535 sessions");
    }
    const auto position = scaled(path, point);
    extent.add(position);
    put_point(bytes, position, point);
    if (bytes.size() > kBlockBytes) bytes.write_to(file);
  }
  bytes.write_to(file);
  file.stream().seekp(0);
  header(frame, extent).write_to(file);
  file.close();
}

ExternalVector<MapPoint> session_map(const SessionData& session, MergedSession placed,
                                     const Eigen::Vector3d& origin) {
  for (Pose& pose : placed.T_map_keyframe) pose.translation -= origin;
  placed.refined.resize(session.keyframes.size());
  const LabelledVoxels voxels = voxelise(session, placed, 0.2F, 1, nullptr);
  return unite({&voxels.fixed}, nullptr);
}

void write_session_las(const std::filesystem::path& path, const SessionData& session,
                       MergedSession placed) {
  const LasFrame frame{odometry_origin(session), {}, last_stamp_ns({&session, 1})};
  write_las(path, session_map(session, std::move(placed), frame.offset), frame);
}

}  // namespace unimapper::merge
