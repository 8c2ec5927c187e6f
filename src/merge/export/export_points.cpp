// Point clouds of a merged map as PLY files.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include "export_files.hpp"

namespace unimapper::merge {
namespace {

using Colour = std::array<std::uint8_t, 3>;

static_assert(std::endian::native == std::endian::little, "PLY is written in machine order");

/// Eight colours that differ on dark and on light and under most colour blindness, repeated.
Colour session_colour(std::size_t session) {
  constexpr Colour kColours[] = {{0, 114, 178},  {230, 159, 0}, {0, 158, 115},  {204, 121, 167},
                                 {86, 180, 233}, {213, 94, 0},  {240, 228, 66}, {153, 102, 51}};
  return kColours[session % std::size(kColours)];
}

/// A session's index or a count of sessions as the files have it. Throws std::runtime_error.
std::uint16_t in_16_bits(std::uint32_t number) {
  if (!std::in_range<std::uint16_t>(number)) {
    throw std::runtime_error("a map file cannot number more than 65536 sessions");
  }
  return static_cast<std::uint16_t>(number);
}

const std::string kColour = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

/// Collects vertices as bytes and writes them in blocks.
class PlyWriter {
 public:
  PlyWriter(const std::filesystem::path& path, std::size_t vertices, const std::string& properties)
      : file_(path) {
    file_.stream() << "ply\nformat binary_little_endian 1.0\nelement vertex " << vertices
                   << "\nproperty float x\nproperty float y\nproperty float z\n"
                   << properties << "end_header\n";
  }

  template <typename T>
  void put(const T& value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    buffer_.append(bytes, sizeof(T));
    if (buffer_.size() > (1U << 20U)) flush();
  }

  void put(const Eigen::Vector3f& position) {
    for (const float value : {position.x(), position.y(), position.z()}) put(value);
  }

  void put(const Eigen::Vector3f& position, const Colour& colour) {
    put(position);
    for (const std::uint8_t value : colour) put(value);
  }

  void close() {
    flush();
    file_.close();
  }

 private:
  void flush() {
    file_.stream().write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
  }

  OutputFile file_;
  std::string buffer_;
};

}  // namespace

void write_map_points(const std::filesystem::path& path, const ExternalVector<MapPoint>& points) {
  const bool has_intensity = std::any_of(
      points.begin(), points.end(), [](const MapPoint& point) { return point.intensity != 0; });
  PlyWriter ply(path, points.size(),
                kColour + "property ushort session\nproperty ushort sessions_seen\n" +
                    (has_intensity ? "property uchar intensity\n" : ""));
  for (const MapPoint& point : points) {
    ply.put(point.position, session_colour(point.session));
    ply.put(in_16_bits(point.session));
    ply.put(in_16_bits(point.sessions_seen));
    if (has_intensity) ply.put(static_cast<std::uint8_t>(point.intensity));
  }
  ply.close();
}

void write_tiles(const std::filesystem::path& folder, const ExternalVector<MapPoint>& points,
                 double tile_m, const LasFrame* las) {
  make_folder(folder);
  std::map<std::pair<std::int64_t, std::int64_t>, ExternalVector<MapPoint>> tiles;
  for (const MapPoint& point : points) {
    const Eigen::Array3d tile = (point.position.cast<double>().array() / tile_m).floor();
    const std::pair key{static_cast<std::int64_t>(tile.x()), static_cast<std::int64_t>(tile.y())};
    tiles.try_emplace(key, points.file()).first->second.push_back(point);
  }
  for (const auto& [tile, content] : tiles) {
    const std::string name = std::to_string(tile.first) + "_" + std::to_string(tile.second);
    write_map_points(folder / (name + ".ply"), content);
    if (las != nullptr) write_las(folder / (name + ".las"), content, *las);
  }
}

void write_changed_points(const std::filesystem::path& path,
                          const std::vector<ChangedPoint>& points) {
  constexpr Colour kAppeared{0, 200, 0};
  constexpr Colour kGone{220, 0, 0};
  PlyWriter ply(
      path, points.size(),
      kColour + "property ushort session\nproperty uchar appeared\nproperty uint object\n");
  for (const ChangedPoint& point : points) {
    ply.put(point.position, point.appeared ? kAppeared : kGone);
    ply.put(in_16_bits(point.session));
    ply.put(static_cast<std::uint8_t>(point.appeared ? 1 : 0));
    ply.put(point.object);
  }
  ply.close();
}

void write_positions(const std::filesystem::path& path,
                     const ExternalVector<Eigen::Vector3f>& points) {
  PlyWriter ply(path, points.size(), "");
  for (const Eigen::Vector3f& point : points) ply.put(point);
  ply.close();
}

}  // namespace unimapper::merge
