#include "src/apps/map/position_file.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "ports/datasets/text.hpp"

namespace unimapper::apps {
namespace {

constexpr double kDegree = 0.017453292519943295769;

/// Earth-centred, earth-fixed.
Eigen::Vector3d earth_centred(const Datum& place) {
  constexpr double kSemiMajorM = 6378137.0;
  constexpr double kFlattening = 1.0 / 298.257223563;
  constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
  const double latitude = place.latitude_deg * kDegree;
  const double longitude = place.longitude_deg * kDegree;
  const double sine = std::sin(latitude);
  const double normal_m = kSemiMajorM / std::sqrt(1.0 - kEccentricity2 * sine * sine);
  const double axis_m = (normal_m + place.height_m) * std::cos(latitude);
  return {axis_m * std::cos(longitude), axis_m * std::sin(longitude),
          (normal_m * (1.0 - kEccentricity2) + place.height_m) * sine};
}

enum class Form : std::uint8_t { kCartesian, kHeight, kDegrees };

class PositionParser {
 public:
  PositionParser(const std::string& file, const std::optional<Datum>& datum, const ToSite& to_site)
      : file_(file), datum_(datum), to_site_(to_site) {}

  void take(std::string_view line, std::size_t number) {
    number_ = number;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.find_first_not_of(" \t") == std::string_view::npos || line.front() == '#') return;
    split(line);
    if (!form_) {
      take_names();
    } else {
      take_row();
    }
  }

  std::vector<PositionRow> rows() && {
    number_ = 0;
    if (!form_ || rows_.empty()) fail("holds no position");
    return std::move(rows_);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(file_ + (number_ > 0 ? ":" + std::to_string(number_) : "") + ": " +
                             why);
  }

  void split(std::string_view line) {
    fields_.clear();
    for (;;) {
      const std::size_t comma = line.find(',');
      std::string_view field = line.substr(0, comma);
      while (!field.empty() && field.front() == ' ') field.remove_prefix(1);
      while (!field.empty() && field.back() == ' ') field.remove_suffix(1);
      fields_.push_back(field);
      if (comma == std::string_view::npos) return;
      line.remove_prefix(comma + 1);
    }
  }

  void take_names() {
    using Names = std::vector<std::string_view>;
    static const std::pair<Names, Form> kForms[] = {
        {{"x", "y", "z", "sigma_xy", "sigma_z"}, Form::kCartesian},
        {{"z", "sigma_z"}, Form::kHeight},
        {{"latitude", "longitude", "height", "sigma_xy", "sigma_z"}, Form::kDegrees}};
    Names names(fields_.begin() + 1, fields_.end());
    columns_ = fields_.size();
    const Names lever = {"lever_x", "lever_y", "lever_z"};
    has_lever_ = names.size() > 3 && Names(names.end() - 3, names.end()) == lever;
    if (has_lever_) names.resize(names.size() - 3);
    sigma_z_ = names.size();
    for (const auto& [known, form] : kForms) {
      if (names == known && (fields_[0] == "keyframe" || fields_[0] == "stamp")) form_ = form;
    }
    if (!form_) {
      fail(
          "the first line names the columns: keyframe or stamp, then x,y,z,sigma_xy,sigma_z, or "
          "z,sigma_z, or latitude,longitude,height,sigma_xy,sigma_z; then, if wanted, "
          "lever_x,lever_y,lever_z");
    }
    by_stamp_ = fields_[0] == "stamp";
    const bool is_degrees = *form_ == Form::kDegrees;
    if (datum_ && !is_degrees) {
      fail("has no latitude and longitude, so --datum has no meaning");
    }
    if (is_degrees && !datum_ && !to_site_) {
      fail(
          "latitude and longitude need a coordinate system (`unimapper map crs EPSG:25832`) or "
          "--datum LATITUDE LONGITUDE HEIGHT");
    }
  }

  [[nodiscard]] double number(std::size_t field, double low, double high) const {
    const std::optional<double> value = datasets::to_number(fields_[field]);
    if (!value) fail(datasets::quoted(fields_[field]) + " is no number");
    if (!(*value >= low && *value <= high)) {
      fail(datasets::quoted(fields_[field]) + " is out of range");
    }
    return *value;
  }

  [[nodiscard]] double deviation(std::size_t field) const { return number(field, 1e-4, 1e6); }
  [[nodiscard]] double metres(std::size_t field) const { return number(field, -1e8, 1e8); }

  void take_row() {
    if (fields_.size() != columns_) {
      fail("has " + std::to_string(fields_.size()) + " columns, not " + std::to_string(columns_));
    }
    PositionRow row;
    row.line = number_;
    take_key(row);
    switch (*form_) {
      case Form::kHeight:
        row.position.z() = metres(1);
        break;
      case Form::kCartesian:
        row.position = {metres(1), metres(2), metres(3)};
        row.sigma_xy_m = deviation(4);
        break;
      case Form::kDegrees:
        row.position =
            place({number(1, -90.0, 90.0), number(2, -180.0, 180.0), number(3, -1e4, 1e5)});
        row.sigma_xy_m = deviation(4);
        break;
    }
    row.sigma_z_m = deviation(sigma_z_);
    if (has_lever_) {
      row.lever.emplace();
      for (std::size_t i = 0; i < 3; ++i) {
        (*row.lever)[static_cast<Eigen::Index>(i)] = number(sigma_z_ + 1 + i, -100.0, 100.0);
      }
    }
    rows_.push_back(row);
  }

  [[nodiscard]] Eigen::Vector3d place(const Datum& place) const {
    return to_site_ ? to_site_(place) : east_north_up(place, *datum_);
  }

  void take_key(PositionRow& row) {
    if (by_stamp_) {
      row.stamp_ns = nanoseconds(fields_[0]);
    } else {
      row.sequence = whole<std::uint32_t>(fields_[0]);
    }
    const std::int64_t key = row.sequence ? std::int64_t{*row.sequence} : row.stamp_ns;
    const auto [before, is_new] = lines_.emplace(key, number_);
    if (!is_new) {
      fail(std::string(by_stamp_ ? "stamp " : "keyframe ") + std::string(fields_[0]) +
           " is in line " + std::to_string(before->second) + ", too");
    }
  }

  template <typename Whole>
  [[nodiscard]] Whole whole(std::string_view text) const {
    Whole value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size()) {
      fail(datasets::quoted(text) + " is no " + (by_stamp_ ? "stamp" : "number of a keyframe"));
    }
    return value;
  }

  /// Seconds with up to nine decimals, exact.
  [[nodiscard]] std::int64_t nanoseconds(std::string_view text) const {
    constexpr std::int64_t kPerSecond = 1000000000;
    const std::size_t point = text.find('.');
    const auto seconds = whole<std::uint32_t>(text.substr(0, point));
    std::int64_t fraction = 0;
    if (point != std::string_view::npos) {
      std::string decimals(text.substr(point + 1));
      if (decimals.empty() || decimals.size() > 9) fail(datasets::quoted(text) + " is no stamp");
      decimals.resize(9, '0');
      fraction = whole<std::uint32_t>(decimals);
    }
    return std::int64_t{seconds} * kPerSecond + fraction;
  }

  const std::string& file_;
  const std::optional<Datum>& datum_;
  const ToSite& to_site_;
  std::size_t number_ = 0;
  std::vector<std::string_view> fields_;
  std::optional<Form> form_;
  bool by_stamp_ = false;
  std::size_t columns_ = 0;
  std::size_t sigma_z_ = 0;  // its column
  bool has_lever_ = false;
  std::map<std::int64_t, std::size_t> lines_;
  std::vector<PositionRow> rows_;
};

}  // namespace

Eigen::Vector3d east_north_up(const Datum& place, const Datum& datum) {
  const double latitude = datum.latitude_deg * kDegree;
  const double longitude = datum.longitude_deg * kDegree;
  const Eigen::Vector3d east(-std::sin(longitude), std::cos(longitude), 0.0);
  const Eigen::Vector3d up(std::cos(latitude) * std::cos(longitude),
                           std::cos(latitude) * std::sin(longitude), std::sin(latitude));
  const Eigen::Vector3d between = earth_centred(place) - earth_centred(datum);
  return {east.dot(between), up.cross(east).dot(between), up.dot(between)};
}

std::vector<PositionRow> parse_positions(std::string_view text, const std::string& file,
                                         const std::optional<Datum>& datum, const ToSite& to_site) {
  PositionParser parser(file, datum, to_site);
  datasets::for_each_line(
      text, [&](std::string_view line, std::size_t number) { parser.take(line, number); });
  return std::move(parser).rows();
}

std::string format_positions(const std::vector<datasets::Fix>& fixes) {
  const bool has_lever =
      std::any_of(fixes.begin(), fixes.end(), [](const auto& fix) { return fix.lever; });
  std::map<std::int64_t, const datasets::Fix*> by_stamp;
  for (const datasets::Fix& fix : fixes) by_stamp.emplace(fix.stamp_ns, &fix);
  std::string text = "stamp,latitude,longitude,height,sigma_xy,sigma_z";
  text += has_lever ? ",lever_x,lever_y,lever_z\n" : "\n";
  for (const auto& [stamp_ns, fix] : by_stamp) {
    text += fmt::format("{}.{:09},{:.10f},{:.10f},{:.4f},{:.4f},{:.4f}", stamp_ns / 1000000000,
                        stamp_ns % 1000000000, fix->latitude_deg, fix->longitude_deg, fix->height_m,
                        fix->sigma_xy_m, fix->sigma_z_m);
    if (has_lever) {
      const Eigen::Vector3d lever = fix->lever.value_or(Eigen::Vector3d::Zero());
      text += fmt::format(",{:.4f},{:.4f},{:.4f}", lever.x(), lever.y(), lever.z());
    }
    text += '\n';
  }
  return text;
}

}  // namespace unimapper::apps
