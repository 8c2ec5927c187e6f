#include "ports/datasets/record_width.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::size_t, 3> kWidths = {4, 5, 6};  // floats of a record
constexpr std::size_t kWidest = 6;

/// Floats of a few files, each from its beginning.
using Sample = std::vector<std::vector<float>>;

Sample read_sample(const std::vector<fs::path>& files) {
  constexpr std::size_t kFiles = 5;
  constexpr std::size_t kBytes = 240 * 1024;  // whole records of every width
  Sample sample;
  const std::size_t step = std::max<std::size_t>(1, files.size() / kFiles);
  for (std::size_t i = 0; i < files.size() && sample.size() < kFiles; i += step) {
    const std::string bytes = read_file(files[i], kBytes);
    std::vector<float> values(bytes.size() / sizeof(float));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(float));
    sample.push_back(std::move(values));
  }
  return sample;
}

/// Sums over one column.
struct ColumnSums {
  double count = 0.0;
  double sum = 0.0;
  double square = 0.0;

  void add(double value) {
    count += 1.0;
    sum += value;
    square += value * value;
  }
};

/// Share of the variance of values that their column explains, 0 to 1.
double explained_share(const std::array<ColumnSums, kWidest>& columns, std::size_t width) {
  ColumnSums all;
  double between = 0.0;
  for (std::size_t c = 0; c < width; ++c) {
    all.count += columns[c].count;
    all.sum += columns[c].sum;
    all.square += columns[c].square;
    if (columns[c].count > 0.0) between += columns[c].sum * columns[c].sum / columns[c].count;
  }
  if (all.count == 0.0) return 0.0;
  const double correction = all.sum * all.sum / all.count;
  const double total = all.square - correction;
  return total > 0.0 ? (between - correction) / total : 0.0;
}

/// How much columns differ if records have `width` floats: in their values and in their size.
double separation(const Sample& sample, std::size_t width) {
  std::array<ColumnSums, kWidest> values;
  std::array<ColumnSums, kWidest> sizes;
  for (const auto& floats : sample) {
    for (std::size_t i = 0; i < floats.size(); ++i) {
      if (!std::isfinite(floats[i])) continue;
      const double size = std::log1p(std::abs(static_cast<double>(floats[i])));
      values[i % width].add(floats[i] < 0.0F ? -size : size);
      sizes[i % width].add(size);
    }
  }
  return explained_share(values, width) + explained_share(sizes, width);
}

/// Values that float32 coordinates, in whatever unit, do not have.
bool is_no_coordinate(float value) {
  const float size = std::abs(value);
  return std::isinf(value) || size > 1e9F || (size > 0.0F && size < 1e-20F);
}

void check_coordinates(const Sample& sample, std::size_t width, const fs::path& file) {
  std::size_t count = 0;
  std::size_t wrong = 0;
  for (const auto& floats : sample) {
    for (std::size_t i = 0; i < floats.size(); ++i) {
      if (i % width >= 3) continue;
      ++count;
      wrong += is_no_coordinate(floats[i]) ? 1 : 0;
    }
  }
  constexpr std::size_t kTolerated = 20;  // one of so many
  if (wrong * kTolerated <= count) return;
  fail(file,
       "holds no float32 coordinates: are these float64, integers, or other records? Name "
       "the fields with --point-fields, e.g. \"x:f8 y:f8 z:f8 intensity:f4\"");
}

/// Column that holds the number of a ring: whole numbers, and several of them.
bool is_ring(const Sample& sample, std::size_t width, std::size_t column) {
  constexpr float kMostRings = 1024.0F;
  float lowest = kMostRings;
  float highest = 0.0F;
  for (const auto& floats : sample) {
    for (std::size_t i = column; i < floats.size(); i += width) {
      const float value = floats[i];
      if (!(value >= 0.0F && value < kMostRings && value == std::floor(value))) return false;
      lowest = std::min(lowest, value);
      highest = std::max(highest, value);
    }
  }
  return highest > lowest;
}

std::string fields_of(const Sample& sample, std::size_t width) {
  std::string fields = "x y z intensity";
  bool has_ring = false;
  for (std::size_t column = 4; column < width; ++column) {
    const bool ring = !has_ring && is_ring(sample, width, column);
    has_ring |= ring;
    fields += ring ? " ring" : " _";
  }
  return fields;
}

/// Files whose size is no multiple: cut off, or of other records.
std::size_t count_partial(const std::vector<std::uint64_t>& sizes, std::size_t bytes) {
  return static_cast<std::size_t>(std::count_if(
      sizes.begin(), sizes.end(), [&](std::uint64_t size) { return size % bytes != 0; }));
}

/// A few files may be cut off.
bool divides_most(const std::vector<std::uint64_t>& sizes, std::size_t bytes) {
  constexpr std::size_t kMostShare = 10;
  const std::size_t partial = count_partial(sizes, bytes);
  return partial == 0 || kMostShare * partial < sizes.size();
}

void check_sizes(const std::vector<fs::path>& files, const std::vector<std::uint64_t>& sizes,
                 std::size_t bytes, std::vector<Note>& notes) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::uint64_t surplus = sizes[i] % bytes;
    if (surplus == 0) continue;
    if (divides_most(sizes, bytes)) {
      notes.push_back(
          {std::to_string(count_partial(sizes, bytes)) + " of " + std::to_string(sizes.size()) +
               " scans are truncated within a point: copy them again; points up to there are "
               "read; the first: " +
               files[i].string(),
           true});
      return;
    }
    fail_at_offset(files[i], sizes[i] - surplus,
                   "truncated: the last point has " + std::to_string(surplus) + " of " +
                       std::to_string(bytes) +
                       " bytes; records of another size are named with --point-fields");
  }
}

/// The number of floats that fits sizes and content.
std::size_t choose_width(const std::vector<std::uint64_t>& sizes, const Sample& sample,
                         const fs::path& file) {
  std::vector<std::size_t> fitting;
  for (const std::size_t width : kWidths) {
    if (divides_most(sizes, width * sizeof(float))) fitting.push_back(width);
  }
  if (fitting.empty()) return kWidths.front();
  std::size_t floats = 0;
  for (const auto& values : sample) floats += values.size();
  constexpr std::size_t kTelling = 1200;
  if (fitting.size() == 1 || floats < kTelling) return fitting.front();
  std::size_t best = fitting.front();
  double largest = 0.0;
  double second = 0.0;
  for (const std::size_t width : fitting) {
    const double found = separation(sample, width);
    if (found > largest) {
      second = largest;
      largest = found;
      best = width;
    } else {
      second = std::max(second, found);
    }
  }
  constexpr double kClearly = 1.3;
  constexpr double kLeast = 0.01;  // chance makes less of this many values
  if (largest < kLeast || largest < kClearly * second) {
    fail(file, "records of " + std::to_string(fitting[0]) + " or " +
                   std::to_string(fitting.back()) +
                   " floats? Sizes and values leave it open: name the fields with "
                   "--point-fields, e.g. \"x y z intensity\" or \"x y z intensity ring\"");
  }
  return best;
}

}  // namespace

RecordLayout find_record_layout(const std::vector<fs::path>& files, const std::string& point_fields,
                                std::vector<Note>& notes) {
  std::vector<std::uint64_t> sizes;
  sizes.reserve(files.size());
  for (const fs::path& file : files) sizes.push_back(file_bytes(file));
  if (!point_fields.empty()) {
    RecordLayout layout = parse_point_fields(point_fields);
    check_sizes(files, sizes, layout.bytes, notes);
    return layout;
  }
  if (lower_case(files.front().stem().extension().string()) == ".pcd") {  // nuScenes
    RecordLayout layout = parse_point_fields("x y z intensity ring");
    check_sizes(files, sizes, layout.bytes, notes);
    return layout;
  }
  const Sample sample = read_sample(files);
  const std::size_t width = choose_width(sizes, sample, files.front());
  check_sizes(files, sizes, width * sizeof(float), notes);
  check_coordinates(sample, width, files.front());
  const std::string fields = fields_of(sample, width);
  if (width != kWidths.front()) {
    notes.push_back({"records of " + std::to_string(width) + " floats, read as " + fields +
                     "; --point-fields overrides"});
  }
  return parse_point_fields(fields);
}

}  // namespace unimapper::datasets
