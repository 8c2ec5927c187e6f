#include "dynamic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unimapper::evaluate {
namespace {

constexpr std::array<std::string_view, kClassCount> kClassNames = {
    "car",           "bicycle",      "bus",      "motorcycle",   "on-rails",     "truck",
    "other-vehicle", "pedestrian",   "cyclist",  "motorcyclist", "road",         "parking",
    "sidewalk",      "other-ground", "building", "fence",        "structure",    "vegetation",
    "trunk",         "terrain",      "pole",     "traffic-sign", "other-object", "unspecified"};

double ratio(std::uint64_t part, std::uint64_t whole) noexcept {
  if (whole == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

Truth truth_of(std::uint32_t label) noexcept {
  const std::uint32_t id = label & 0xFFFFU;
  if (id <= 1) return Truth::kIgnored;
  return id >= 251 && id <= 259 ? Truth::kDynamic : Truth::kStatic;
}

bool is_removed(std::uint32_t label) noexcept { return truth_of(label) == Truth::kDynamic; }

std::size_t class_of(std::uint32_t label) noexcept {
  switch (label & 0xFFFFU) {
    case 10:
    case 252:
      return 0;
    case 11:
      return 1;
    case 13:
    case 257:
      return 2;
    case 15:
      return 3;
    case 16:
    case 256:
      return 4;
    case 18:
    case 258:
      return 5;
    case 20:
    case 259:
      return 6;
    case 30:
    case 254:
      return 7;
    case 31:
    case 253:
      return 8;
    case 32:
    case 255:
      return 9;
    case 40:
    case 60:
      return 10;
    case 44:
      return 11;
    case 48:
      return 12;
    case 49:
      return 13;
    case 50:
      return 14;
    case 51:
      return 15;
    case 52:
      return 16;
    case 70:
      return 17;
    case 71:
      return 18;
    case 72:
      return 19;
    case 80:
      return 20;
    case 81:
      return 21;
    case 99:
      return 22;
    default:
      return 23;
  }
}

std::string_view class_name(std::size_t index) noexcept {
  return index < kClassCount ? kClassNames[index] : kClassNames[kClassCount - 1];
}

void Tally::add(Truth truth, bool removed) noexcept {
  if (truth == Truth::kStatic) {
    ++static_points;
    static_kept += removed ? 0 : 1;
  } else if (truth == Truth::kDynamic) {
    ++dynamic_points;
    dynamic_removed += removed ? 1 : 0;
  }
}

Tally& Tally::operator+=(const Tally& other) noexcept {
  static_points += other.static_points;
  static_kept += other.static_kept;
  dynamic_points += other.dynamic_points;
  dynamic_removed += other.dynamic_removed;
  return *this;
}

double Tally::static_accuracy() const noexcept { return ratio(static_kept, static_points); }
double Tally::dynamic_accuracy() const noexcept { return ratio(dynamic_removed, dynamic_points); }

double Tally::associated_accuracy() const noexcept {
  return std::sqrt(static_accuracy() * dynamic_accuracy());
}

double Tally::harmonic_accuracy() const noexcept {
  const double sa = static_accuracy();
  const double da = dynamic_accuracy();
  if (sa + da == 0.0) return 0.0;
  return 2.0 * sa * da / (sa + da);
}

std::size_t range_bin(float range_m) noexcept {
  std::size_t bin = 0;
  while (bin < kRangeBinEnds.size() && range_m >= kRangeBinEnds[bin]) ++bin;
  return bin;
}

std::string range_bin_name(std::size_t bin) {
  const auto metres = [](std::size_t end) {
    return std::to_string(static_cast<int>(kRangeBinEnds[end]));
  };
  std::string name = bin == 0 ? "0" : metres(bin - 1);
  if (bin >= kRangeBinEnds.size()) return name.append("+");
  return name.append("-").append(metres(bin));
}

void DynamicScore::add(std::uint32_t truth_label, float range_m, bool removed) noexcept {
  const Truth truth = truth_of(truth_label);
  if (truth == Truth::kIgnored) {
    ++ignored;
    return;
  }
  total.add(truth, removed);
  by_class[class_of(truth_label)].add(truth, removed);
  by_range[range_bin(range_m)].add(truth, removed);
}

void score_scan(const ScoredScan& scan, DynamicScore& score) {
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!scan.points[i].allFinite()) {
      ++score.ignored;
      continue;
    }
    score.add(scan.truth[i], scan.points[i].norm(), is_removed(scan.predicted[i]));
  }
}

DynamicScore score_points(ScanSource& source) {
  DynamicScore score;
  for (std::size_t s = 0; s < source.scan_count(); ++s) score_scan(source.scan(s), score);
  return score;
}

}  // namespace unimapper::evaluate
