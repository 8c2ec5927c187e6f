#include "ports/datasets/sequence.hpp"

#include <charconv>
#include <numeric>

#include "ports/datasets/files.hpp"

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

}  // namespace

std::vector<std::size_t> match_lines(const std::vector<fs::path>& files, std::size_t lines,
                                     const fs::path& text_file, const std::string& what) {
  const std::string counts =
      std::to_string(lines) + " " + what + " for " + std::to_string(files.size()) + " scans";
  if (lines < files.size()) fail(text_file, counts);
  std::vector<std::size_t> matched(files.size());
  std::iota(matched.begin(), matched.end(), std::size_t{0});
  if (lines == files.size()) return matched;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string stem = files[i].stem().string();
    const char* end = stem.data() + stem.size();
    const auto [parsed_to, error] = std::from_chars(stem.data(), end, matched[i]);
    if (error != std::errc() || parsed_to != end || matched[i] >= lines) {
      fail(text_file, counts + ", and the name of " + files[i].filename().string() +
                          " does not say which line is its own");
    }
  }
  return matched;
}

Sequence make_sequence(std::vector<fs::path> files, const Trajectory& trajectory,
                       const fs::path& poses_file, const fs::path& times_file) {
  Sequence sequence;
  const auto pose_lines = match_lines(files, trajectory.poses.size(), poses_file, "poses");
  sequence.poses = pick(trajectory.poses, pose_lines);
  if (!times_file.empty() && fs::exists(times_file)) {
    const auto stamps_ns = parse_times(read_file(times_file), times_file);
    const auto time_lines = match_lines(files, stamps_ns.size(), times_file, "times");
    sequence.stamps_ns = pick(stamps_ns, time_lines);
  } else if (!trajectory.stamps_ns.empty()) {
    sequence.stamps_ns = pick(trajectory.stamps_ns, pose_lines);
  } else {
    for (std::size_t i = 0; i < files.size(); ++i) {
      sequence.stamps_ns.push_back(static_cast<std::int64_t>(i) * kDefaultPeriod_ns);
    }
  }
  sequence.files = std::move(files);
  return sequence;
}

}  // namespace unimapper::datasets
