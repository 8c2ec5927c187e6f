#include "ports/datasets/writers.hpp"

#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "files are written as memory lies");

namespace {

/// Output file; an incomplete one throws.
class OutputFile {
 public:
  explicit OutputFile(const fs::path& file) : file_(file), stream_(std::fopen(file.c_str(), "wb")) {
    if (stream_ == nullptr) refuse();
  }
  ~OutputFile() {
    if (stream_ != nullptr) std::fclose(stream_);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t bytes) {
    if (bytes != 0 && std::fwrite(data, 1, bytes, stream_) != bytes) refuse();
  }
  void write(std::string_view text) { write(text.data(), text.size()); }

  /// Must be the last call: only closing tells whether everything reached the disk.
  void close() {
    std::FILE* stream = stream_;
    stream_ = nullptr;
    if (std::fclose(stream) != 0) refuse();
  }

 private:
  [[noreturn]] void refuse() const {
    fail(file_, std::string("cannot write: ") + std::strerror(errno));
  }

  const fs::path& file_;
  std::FILE* stream_;
};

/// The shortest text that reads back as the same double, in any locale.
void append_number(std::string& text, double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  text.append(buffer, result.ptr);
}

void append_seconds(std::string& text, std::int64_t stamp_ns) {
  constexpr std::uint64_t kPerSecond = kNanosecondsPerSecond;
  const auto bits = static_cast<std::uint64_t>(stamp_ns);
  const std::uint64_t magnitude = stamp_ns < 0 ? 0 - bits : bits;
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%s%llu.%09llu", stamp_ns < 0 ? "-" : "",
                static_cast<unsigned long long>(magnitude / kPerSecond),
                static_cast<unsigned long long>(magnitude % kPerSecond));
  text += buffer;
}

template <typename Value>
constexpr std::string_view kPlyType = "";
template <>
constexpr std::string_view kPlyType<std::uint8_t> = "uchar";
template <>
constexpr std::string_view kPlyType<std::uint16_t> = "ushort";
template <>
constexpr std::string_view kPlyType<std::uint32_t> = "uint";
template <>
constexpr std::string_view kPlyType<float> = "float";

std::string ply_header(const PlyCloud& cloud) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(cloud.positions.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!cloud.colors.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  for (const PlyProperty& property : cloud.properties) {
    std::visit(
        [&]<typename Value>(std::span<const Value>) {
          header += "property " + std::string(kPlyType<Value>) + " " + property.name + "\n";
        },
        property.values);
  }
  return header + "end_header\n";
}

void check_lengths(const fs::path& file, const PlyCloud& cloud) {
  const std::size_t count = cloud.positions.size();
  if (!cloud.colors.empty() && cloud.colors.size() != count) {
    fail(file, "as many colours as positions are needed");
  }
  for (const PlyProperty& property : cloud.properties) {
    const std::size_t values = std::visit([](auto span) { return span.size(); }, property.values);
    if (values != count) fail(file, "as many values of " + property.name + " as positions needed");
  }
}

template <typename Value>
void append_bytes(std::string& bytes, const Value& value) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof value);
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

void append_vertex(std::string& bytes, const PlyCloud& cloud, std::size_t i) {
  for (const float coordinate : cloud.positions[i]) append_bytes(bytes, coordinate);
  if (!cloud.colors.empty()) {
    append_bytes(bytes, cloud.colors[i].red);
    append_bytes(bytes, cloud.colors[i].green);
    append_bytes(bytes, cloud.colors[i].blue);
  }
  for (const PlyProperty& property : cloud.properties) {
    std::visit([&](auto span) { append_bytes(bytes, span[i]); }, property.values);
  }
}

}  // namespace

void make_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) fail(directory, "cannot create the directory: " + error.message());
  if (!fs::is_directory(directory, error)) fail(directory, "is not a directory");
}

void write_kitti_scan(const fs::path& file, std::span<const Scan::Point> points) {
  OutputFile output(file);
  output.write(points.data(), points.size_bytes());
  output.close();
}

void write_labels(const fs::path& file, std::span<const std::uint32_t> labels) {
  OutputFile output(file);
  output.write(labels.data(), labels.size_bytes());
  output.close();
}

void write_kitti_poses(const fs::path& file, std::span<const Pose> poses) {
  OutputFile output(file);
  std::string line;
  for (const Pose& pose : poses) {
    line.clear();
    for (Eigen::Index row = 0; row < 3; ++row) {
      for (Eigen::Index column = 0; column < 3; ++column) {
        append_number(line, pose.rotation(row, column));
        line += ' ';
      }
      append_number(line, pose.translation(row));
      line += row < 2 ? ' ' : '\n';
    }
    output.write(line);
  }
  output.close();
}

void write_times(const fs::path& file, std::span<const std::int64_t> stamps_ns) {
  OutputFile output(file);
  std::string line;
  for (const std::int64_t stamp_ns : stamps_ns) {
    line.clear();
    append_seconds(line, stamp_ns);
    line += '\n';
    output.write(line);
  }
  output.close();
}

void write_tum(const fs::path& file, std::span<const std::int64_t> stamps_ns,
               std::span<const Pose> poses) {
  if (stamps_ns.size() != poses.size()) fail(file, "as many stamps as poses are needed");
  OutputFile output(file);
  std::string line;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    line.clear();
    append_seconds(line, stamps_ns[i]);
    const Eigen::Vector3d& t = poses[i].translation;
    const Eigen::Quaterniond q = poses[i].quaternion();
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
      line += ' ';
      append_number(line, value);
    }
    line += '\n';
    output.write(line);
  }
  output.close();
}

void write_text(const fs::path& file, std::string_view text) {
  OutputFile output(file);
  output.write(text);
  output.close();
}

void write_ply(const fs::path& file, const PlyCloud& cloud) {
  check_lengths(file, cloud);
  OutputFile output(file);
  output.write(ply_header(cloud));
  constexpr std::size_t kFlushBytes = 1U << 16U;
  std::string buffer;
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
    append_vertex(buffer, cloud, i);
    if (buffer.size() < kFlushBytes) continue;
    output.write(buffer);
    buffer.clear();
  }
  output.write(buffer);
  output.close();
}

}  // namespace unimapper::datasets
