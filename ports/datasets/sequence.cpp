#include "ports/datasets/sequence.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <numeric>
#include <optional>
#include <utility>

#include "ports/datasets/files.hpp"
#include "ports/datasets/pose_track.hpp"
#include "ports/datasets/recorded_stamps.hpp"
#include "ports/datasets/text_encoding.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

template <typename T>
std::vector<T> pick(const std::vector<T>& values, const std::vector<std::size_t>& lines) {
  std::vector<T> picked;
  picked.reserve(lines.size());
  for (const std::size_t line : lines) picked.push_back(values.at(line));
  return picked;
}

/// The number at the end of every name, if all names begin alike; empty at the first without.
std::vector<std::size_t> numbers_of(const std::vector<fs::path>& files, std::size_t lines,
                                    const fs::path*& without) {
  std::vector<std::size_t> numbers;
  std::string prefix;
  for (const fs::path& file : files) {
    const std::string stem = stem_of(file);
    const NumberInName name = number_in_name(stem);
    if (&file == &files.front()) prefix = name.prefix;
    const char* end = name.digits.data() + name.digits.size();
    std::size_t number = 0;
    const auto [parsed_to, error] = std::from_chars(name.digits.data(), end, number);
    if (error != std::errc() || parsed_to != end || name.prefix != prefix || number >= lines) {
      without = &file;
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

std::vector<std::size_t> match_lines(const std::vector<fs::path>& files, std::size_t lines,
                                     const fs::path& text_file, const std::string& what,
                                     bool are_numbered_by_line) {
  const std::string counts =
      std::to_string(lines) + " " + what + " for " + std::to_string(files.size()) + " scans";
  if (lines < files.size()) {
    fail(text_file, counts +
                        ": give one a scan, or stamps to both: times.txt or stamps as names "
                        "of the scans, and poses in TUM form");
  }
  std::vector<std::size_t> matched(files.size());
  std::iota(matched.begin(), matched.end(), std::size_t{0});
  if (lines == files.size()) return matched;
  const fs::path* without = nullptr;
  matched = numbers_of(files, lines, without);
  if (without != nullptr) {
    fail(text_file, counts + ", and the name of " + without->filename().string() +
                        " does not say which line is its own");
  }
  const auto [first, last] = std::minmax_element(matched.begin(), matched.end());
  if (are_numbered_by_line || *last + 1 == lines || *first > 1) return matched;
  fail(
      text_file,
      counts + " numbered " + std::to_string(*first) + " to " + std::to_string(*last) +
          ": are the poses at a higher rate? Give stamps to both (times.txt with a line a scan, or "
          "stamps as names of the scans, and poses in TUM form). For an excerpt of a longer "
          "recording keep the lines of its scans only");
}

namespace {

/// 0, 1, 2, ... or 1, 2, 3, ... seconds: line numbers where stamps belong.
bool are_line_numbers(const std::vector<std::int64_t>& stamps_ns) {
  if (stamps_ns.size() < 3 || stamps_ns[0] < 0 || stamps_ns[0] > kNanosecondsPerSecond)
    return false;
  for (std::size_t i = 0; i < stamps_ns.size(); ++i) {
    if (stamps_ns[i] != stamps_ns[0] + static_cast<std::int64_t>(i) * kNanosecondsPerSecond) {
      return false;
    }
  }
  return stamps_ns[0] % kNanosecondsPerSecond == 0;
}

/// Leaves out scans whose stamp alone contradicts their order; poses by line do not follow a clock
/// that is set back.
void mend_stamps(Sequence& sequence, const fs::path& source, bool by_stamp) {
  RecordedStamps found = check_recorded_stamps(sequence.stamps_ns, {});
  if (by_stamp) found.steps.clear();
  if (found.steps.empty() && found.glitches == 0) return;
  note_stamps(found, "scan", source.string(), sequence.notes);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < sequence.stamps_ns.size(); ++i) {
    sequence.stamps_ns[i] = found.without_steps(i, sequence.stamps_ns[i]);
    if (!found.is_glitch[i]) kept.push_back(i);
  }
  sequence.files = pick(sequence.files, kept);
  sequence.poses = pick(sequence.poses, kept);
  sequence.stamps_ns = pick(sequence.stamps_ns, kept);
}

/// Scans that are not later than the one before are refused one by one later; many of them mean
/// that these are no stamps.
void check_increasing(Sequence& sequence, const fs::path& source) {
  std::size_t late = 0;
  std::size_t first = 0;
  for (std::size_t i = 1; i < sequence.stamps_ns.size(); ++i) {
    if (sequence.stamps_ns[i] > sequence.stamps_ns[i - 1]) continue;
    if (late++ == 0) first = i;
  }
  if (late == 0) return;
  const std::string reason = std::to_string(late) + " of " + std::to_string(sequence.files.size()) +
                             " scans are not later than the one before, first " +
                             sequence.files[first].filename().string() + " at " +
                             seconds_text(sequence.stamps_ns[first]);
  if (2 * late > sequence.files.size()) fail(source, reason + ": are these stamps?");
  sequence.notes.push_back({source.string() + ": " + reason, true});
}

/// Files and their stamps in order of the stamps, which names in natural order need not be:
/// 1.5 comes behind 1.25.
void sort_by_stamp(std::vector<fs::path>& files, std::vector<std::int64_t>& stamps_ns) {
  std::vector<std::size_t> order(files.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return stamps_ns[a] < stamps_ns[b]; });
  files = pick(files, order);
  stamps_ns = pick(stamps_ns, order);
}

void note_distance(const TimedPoses& found, Sequence& sequence) {
  char text[200];
  std::snprintf(text, sizeof text, "poses by stamp, a scan at most %.0f ms from the nearest",
                static_cast<double>(found.farthest_ns) * 1e-6);
  sequence.notes.push_back({text});
  const std::size_t missing = found.outside + found.in_gaps;
  if (missing == 0) return;
  std::snprintf(text, sizeof text,
                "%zu of %zu scans left out: %zu before the first or after the last pose, %zu "
                "between poses more than 0.5 s apart",
                missing, found.poses.size(), found.outside, found.in_gaps);
  // A robot whose odometry starts late or ends early is no surprise.
  constexpr std::size_t kUsualShare = 20;
  const bool is_warning = found.in_gaps > 0 || kUsualShare * missing > found.poses.size();
  sequence.notes.push_back({text, is_warning});
}

/// Without the poses whose stamp alone contradicts their order.
Trajectory without_glitches(const Trajectory& trajectory, const fs::path& file,
                            Sequence& sequence) {
  RecordedStamps found = check_recorded_stamps(trajectory.stamps_ns, {});
  // A clock that is set back looks like a second drive: nothing is taken as if it were none.
  if (!found.steps.empty() || found.glitches == 0) return trajectory;
  note_stamps(found, "pose", file.string(), sequence.notes);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < found.is_glitch.size(); ++i) {
    if (!found.is_glitch[i]) kept.push_back(i);
  }
  return {pick(trajectory.poses, kept), pick(trajectory.stamps_ns, kept)};
}

}  // namespace

Sequence take_by_stamp(const std::vector<fs::path>& files,
                       const std::vector<std::int64_t>& stamps_ns, const Trajectory& trajectory,
                       const fs::path& poses_file) {
  Sequence sequence;
  const TimedPoses found =
      poses_at(stamps_ns, without_glitches(trajectory, poses_file, sequence), poses_file);
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!found.poses[i]) continue;
    sequence.files.push_back(files[i]);
    sequence.poses.push_back(*found.poses[i]);
    sequence.stamps_ns.push_back(stamps_ns[i]);
  }
  const auto note_poses = [&](std::size_t count, const char* what) {
    if (count == 0) return;
    sequence.notes.push_back(
        {poses_file.string() + ": " + std::to_string(count) + " poses " + what, true});
  };
  note_poses(trajectory.not_finite, "are not finite and are left out");
  note_poses(found.copies, "are there twice and are taken once");
  note_poses(found.was_sorted ? trajectory.poses.size() : 0,
             "are not in the order of their stamps: sorted");
  note_distance(found, sequence);
  return sequence;
}

namespace {

/// Association of the parts of one sequence.
class Association {
 public:
  explicit Association(SequenceParts parts) : parts_(std::move(parts)) {}

  Sequence run() {
    find_stamps();
    const bool by_stamp = stamps_ns_ && !parts_.trajectory.stamps_ns.empty() &&
                          !are_line_numbers(parts_.trajectory.stamps_ns);
    if (by_stamp) {
      take_by_stamp();
    } else {
      take_by_line();
    }
    mend_stamps(sequence_, stamps_source_, by_stamp);
    check_increasing(sequence_, stamps_source_);
    return std::move(sequence_);
  }

 private:
  void find_stamps() {
    if (auto stamps_ns = stamps_of_names(parts_.files)) {
      sort_by_stamp(parts_.files, *stamps_ns);
      stamps_ns_ = std::move(stamps_ns);
      stamps_source_ = parts_.files.front().parent_path();
    }
    if (parts_.times_file.empty() || !fs::exists(parts_.times_file)) return;
    const auto times_ns = parse_times(read_text(parts_.times_file), parts_.times_file);
    // As many times as poses: both are of the whole sequence that the scans are an excerpt of.
    if (times_ns.size() == parts_.trajectory.poses.size()) parts_.are_numbered_by_line = true;
    stamps_ns_ = pick(times_ns, match_lines(parts_.files, times_ns.size(), parts_.times_file,
                                            "times", parts_.are_numbered_by_line));
    stamps_source_ = parts_.times_file;
  }

  void take_by_stamp() {
    sequence_ =
        datasets::take_by_stamp(parts_.files, *stamps_ns_, parts_.trajectory, parts_.poses_file);
  }

  void take_by_line() {
    const auto& trajectory = parts_.trajectory;
    if (trajectory.not_finite > 0) {
      fail(parts_.poses_file, std::to_string(trajectory.not_finite) +
                                  " poses are not finite, so lines do not number the scans: give "
                                  "stamps to the scans (times.txt, or as their names), or leave "
                                  "these scans out");
    }
    const auto lines = match_lines(parts_.files, trajectory.poses.size(), parts_.poses_file,
                                   "poses", parts_.are_numbered_by_line);
    sequence_.poses = pick(trajectory.poses, lines);
    if (trajectory.poses.size() > parts_.files.size()) {
      sequence_.notes.push_back({std::to_string(trajectory.poses.size()) + " poses for " +
                                 std::to_string(parts_.files.size()) +
                                 " scans: each has the line that its name numbers, from 0"});
    }
    if (stamps_ns_) {
      sequence_.stamps_ns = *stamps_ns_;
    } else if (!trajectory.stamps_ns.empty() && !are_line_numbers(trajectory.stamps_ns)) {
      sequence_.stamps_ns = pick(trajectory.stamps_ns, lines);
      stamps_source_ = parts_.poses_file;
    } else {
      count_at_default_rate();
    }
    sequence_.files = std::move(parts_.files);
  }

  void count_at_default_rate() {
    for (std::size_t i = 0; i < parts_.files.size(); ++i) {
      sequence_.stamps_ns.push_back(static_cast<std::int64_t>(i) * kDefaultPeriod_ns);
    }
    if (parts_.files.size() > 1)
      sequence_.notes.push_back({"no stamps: taken at 10 scans a second"});
  }

  SequenceParts parts_;
  std::optional<std::vector<std::int64_t>> stamps_ns_;  // of the scans
  fs::path stamps_source_;
  Sequence sequence_;
};

}  // namespace

FolderPoses read_folder_poses(const fs::path& poses_file, std::size_t scans,
                              const OpenOptions& options) {
  const bool is_missing = options.poses.empty() && (poses_file.empty() || !fs::exists(poses_file));
  if (options.own_odometry || is_missing) {
    return {{std::vector<Pose>(scans), {}}, false};
  }
  return {parse_trajectory(read_text(poses_file), poses_file)};
}

Sequence make_sequence(SequenceParts parts) { return Association(std::move(parts)).run(); }

}  // namespace unimapper::datasets
