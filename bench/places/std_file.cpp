#include "bench/places/std_file.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "ports/datasets/files.hpp"

namespace unimapper::bench {
namespace {

constexpr std::array<char, 8> kMagic = {'S', 'T', 'D', 'p', 'l', 'a', 'c', '1'};
// Of a keypoint: position, normal, count; of a plane: center, normal.
constexpr std::size_t kKeypointBytes = 7 * sizeof(double);
constexpr std::size_t kPlaneBytes = 6 * sizeof(double);

class ByteSink {
 public:
  explicit ByteSink(const std::filesystem::path& file) : file_(file), out_(file, std::ios::binary) {
    out_.write(kMagic.data(), kMagic.size());
  }
  void operator()(std::uint32_t value) { put(&value, sizeof value); }
  void operator()(double value) { put(&value, sizeof value); }
  void operator()(const Eigen::Vector3d& value) { put(value.data(), 3 * sizeof(double)); }
  void finish() {
    out_.close();
    if (!out_) throw std::runtime_error(file_.string() + ": cannot be written");
  }

 private:
  void put(const void* bytes, std::size_t size) {
    out_.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  }
  const std::filesystem::path& file_;
  std::ofstream out_;
};

class ByteSource {
 public:
  explicit ByteSource(const std::filesystem::path& file)
      : file_(file), bytes_(datasets::read_file(file)) {
    std::array<char, 8> magic{};
    get(magic.data(), magic.size());
    if (magic != kMagic) throw std::runtime_error(file.string() + ": holds no STD descriptions");
  }
  void operator()(std::uint32_t& value) { get(&value, sizeof value); }
  void operator()(double& value) { get(&value, sizeof value); }
  void operator()(Eigen::Vector3d& value) { get(value.data(), 3 * sizeof(double)); }
  /// A number of items of at least `bytes` each.
  std::uint32_t count(std::size_t bytes) {
    std::uint32_t items = 0;
    (*this)(items);
    if (items > (bytes_.size() - at_) / bytes) fail_truncated();
    return items;
  }

 private:
  void get(void* bytes, std::size_t size) {
    if (bytes_.size() - at_ < size) fail_truncated();
    std::memcpy(bytes, bytes_.data() + at_, size);
    at_ += size;
  }
  [[noreturn]] void fail_truncated() const {
    throw std::runtime_error(file_.string() + ": ends too early");
  }
  const std::filesystem::path& file_;
  std::string bytes_;
  std::size_t at_ = 0;
};

void write_std_place(ByteSink& sink, const StdPlace& place) {
  sink(static_cast<std::uint32_t>(place.keypoints.size()));
  for (const StdKeypoint& keypoint : place.keypoints) {
    sink(keypoint.position);
    sink(keypoint.normal);
    sink(keypoint.count);
  }
  sink(static_cast<std::uint32_t>(place.planes.size()));
  for (const StdPlane& plane : place.planes) {
    sink(plane.center);
    sink(plane.normal);
  }
}

StdPlace read_std_place(ByteSource& source) {
  StdPlace place;
  place.keypoints.resize(source.count(kKeypointBytes));
  for (StdKeypoint& keypoint : place.keypoints) {
    source(keypoint.position);
    source(keypoint.normal);
    source(keypoint.count);
  }
  place.planes.resize(source.count(kPlaneBytes));
  for (StdPlane& plane : place.planes) {
    source(plane.center);
    source(plane.normal);
  }
  return place;
}

}  // namespace

void write_std_file(const std::filesystem::path& file, const std::vector<StdKeyframe>& keyframes) {
  ByteSink sink(file);
  sink(static_cast<std::uint32_t>(keyframes.size()));
  for (const StdKeyframe& keyframe : keyframes) {
    sink(keyframe.sequence);
    sink(keyframe.milliseconds);
    write_std_place(sink, keyframe.place);
  }
  sink.finish();
}

std::vector<StdKeyframe> read_std_file(const std::filesystem::path& file) {
  ByteSource source(file);
  // A keyframe is its number, its time and two counts at least.
  std::vector<StdKeyframe> keyframes(source.count(3 * sizeof(std::uint32_t) + sizeof(double)));
  for (StdKeyframe& keyframe : keyframes) {
    source(keyframe.sequence);
    source(keyframe.milliseconds);
    keyframe.place = read_std_place(source);
  }
  return keyframes;
}

}  // namespace unimapper::bench
