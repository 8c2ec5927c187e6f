#include "src/apps/evaluate/motions.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace unimapper::apps {

std::optional<std::vector<evaluate::MotionInterval>> read_motions(
    const std::filesystem::path& directory) {
  const std::filesystem::path file = directory / "motion.txt";
  if (!std::filesystem::exists(file)) return std::nullopt;
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<evaluate::MotionInterval> motions;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    evaluate::MotionInterval motion;
    std::string rest;
    const bool is_read =
        static_cast<bool>(words >> motion.object >> motion.first_scan >> motion.last_scan);
    if (!is_read || motion.last_scan < motion.first_scan || words >> rest) {
      throw std::runtime_error(file.string() + ": line " + std::to_string(number) +
                               " is not an object with its first and last scan in motion");
    }
    motions.push_back(motion);
  }
  return motions;
}

}  // namespace unimapper::apps
