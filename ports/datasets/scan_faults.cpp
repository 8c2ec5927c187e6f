#include "ports/datasets/scan_faults.hpp"

#include <array>
#include <bit>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "ports/datasets/decorator.hpp"

namespace unimapper::datasets {
namespace {

/// Seconds, milliseconds, ...
std::string unit_name(double seconds_per_unit) {
  if (seconds_per_unit >= 1.0) return "s";
  if (seconds_per_unit >= 1e-3) return "ms";
  return seconds_per_unit >= 1e-6 ? "us" : "ns";
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t part) {
  hash = (hash ^ part) * 0x9E3779B97F4A7C15U;
  return hash ^ hash >> 32U;
}

/// Of the coordinates, bit by bit; never 0.
std::uint64_t fingerprint_of(const std::vector<Scan::Point>& points) {
  // Each multiplication waits for the one before: four rows of them do not wait for each other.
  constexpr std::size_t kRows = 4;
  std::array<std::uint64_t, kRows> rows{points.size(), 1, 2, 3};
  const auto add = [&](std::size_t row, const Scan::Point& p) {
    rows[row] = mixed(rows[row], std::uint64_t{std::bit_cast<std::uint32_t>(p.x)} << 32U |
                                     std::bit_cast<std::uint32_t>(p.y));
    rows[row] = mixed(rows[row], std::bit_cast<std::uint32_t>(p.z));
  };
  std::size_t i = 0;
  for (; i + kRows <= points.size(); i += kRows) {
    for (std::size_t row = 0; row < kRows; ++row) add(row, points[i + row]);
  }
  for (; i < points.size(); ++i) add(i % kRows, points[i]);
  return mixed(mixed(mixed(rows[0], rows[1]), rows[2]), rows[3]) | 1U;
}

class CountedFaults : public DatasetDecorator {
 public:
  explicit CountedFaults(std::unique_ptr<Dataset> dataset) : DatasetDecorator(std::move(dataset)) {}

  void read_scan(std::size_t i, Scan& scan) const override {
    try {
      inner().read_scan(i, scan);
      scan.fingerprint = scan.points.empty() ? 0 : fingerprint_of(scan.points);
      if (!scan.points.empty()) {
        times_[i] = {scan.seconds_per_time_unit, scan.points_without_time, scan.points.size()};
      }
    } catch (const DatasetError& error) {
      scan.reset(0);
      count_damaged(i, error.what());
    }
  }

  [[nodiscard]] std::vector<Note> notes() const override {
    std::vector<Note> notes = inner().notes();
    if (!damaged_.empty()) {
      notes.push_back(
          {share_text(damaged_.size()) +
               (damaged_.size() == 1 ? " cannot be read and is" : " cannot be read and are") +
               " left out; the first: " + first_,
           true});
    }
    note_units(notes);
    note_points_without_time(notes);
    return notes;
  }

 private:
  struct Times {
    double seconds_per_unit;
    std::size_t without;
    std::size_t points;
  };

  [[nodiscard]] std::string share_text(std::size_t scans) const {
    return std::to_string(scans) + " of " + std::to_string(scan_count()) + " scans";
  }

  void count_damaged(std::size_t i, const std::string& reason) const {
    if (damaged_.empty()) first_ = reason;
    damaged_.insert(i);
    constexpr std::size_t kMostShare = 10;
    if (kMostShare * damaged_.size() < scan_count()) return;
    if (damaged_.size() == 1) throw DatasetError(first_);
    throw DatasetError(first_ + "; " + share_text(damaged_.size()) + " cannot be read");
  }

  /// A driver whose settings change, or that loses its clock, while it is recorded.
  void note_units(std::vector<Note>& notes) const {
    std::map<double, std::pair<std::size_t, std::size_t>> units;  // scans and the first of them
    for (const auto& [i, times] : times_) {
      auto& [scans, first] = units.try_emplace(times.seconds_per_unit, 0, i).first->second;
      ++scans;
    }
    if (units.size() < 2) return;
    std::string text;
    for (const auto& [seconds_per_unit, found] : units) {
      text += (text.empty() ? "" : ", ") + std::to_string(found.first) +
              (seconds_per_unit > 0.0 ? " in " + unit_name(seconds_per_unit) : " without any") +
              " (the first: " + scan_name(found.second) + ")";
    }
    notes.push_back(
        {"times of points differ from scan to scan: of " + std::to_string(times_.size()) +
             " scans read " + text +
             (units.contains(0.0) ? "; those without any are not compensated for the motion" : ""),
         true});
  }

  void note_points_without_time(std::vector<Note>& notes) const {
    std::size_t without = 0;
    std::size_t scans = 0;
    std::size_t points = 0;
    for (const auto& [i, times] : times_) {
      without += times.without;
      scans += times.without > 0 ? 1 : 0;
      points += times.points;
    }
    if (without == 0) return;
    constexpr std::size_t kWarningShare = 100;
    notes.push_back({std::to_string(without) + " points in " + std::to_string(scans) + " of " +
                         std::to_string(times_.size()) +
                         " scans read have no time within their scan's sweep: that of the "
                         "point before them is taken",
                     kWarningShare * without > points});
  }

  // Scans are read more than once.
  mutable std::set<std::size_t> damaged_;
  mutable std::string first_;
  mutable std::map<std::size_t, Times> times_;
};

}  // namespace

std::unique_ptr<Dataset> with_counted_faults(std::unique_ptr<Dataset> dataset) {
  return std::make_unique<CountedFaults>(std::move(dataset));
}

}  // namespace unimapper::datasets
