// Navigation grid as an image and its description, as ROS's map server reads them.
#include <algorithm>
#include <cstdio>
#include <string>

#include "export_files.hpp"

namespace unimapper::merge {
namespace {

/// Thresholds of the description: cells between the two are unknown. The customary grey of 205
/// would be free under the newer programs' threshold.
constexpr const char* kThresholds = "occupied_thresh: 0.65\nfree_thresh: 0.25\n";
char grey(GridCell cell) {
  switch (cell) {
    case GridCell::kFree:
      return static_cast<char>(254);
    case GridCell::kOccupied:
      return 0;
    case GridCell::kUnknown:
      break;
  }
  return static_cast<char>(128);
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value == 0.0 ? 0.0 : value);
  return text;
}

}  // namespace

void write_grid(const std::filesystem::path& folder, const std::string& name,
                const NavigationGrid& grid) {
  OutputFile image(folder / (name + ".pgm"));
  image.stream() << "P5\n" << grid.width << ' ' << grid.height << "\n255\n";
  // The first row of an image is its upper one.
  std::string row(grid.width, '\0');
  for (std::uint32_t y = grid.height; y-- > 0;) {
    for (std::uint32_t x = 0; x < grid.width; ++x) row[x] = grey(grid.at(x, y));
    image.stream().write(row.data(), static_cast<std::streamsize>(row.size()));
  }
  image.close();
  OutputFile description(folder / (name + ".yaml"));
  description.stream() << "image: " << name
                       << ".pgm\nmode: trinary\nresolution: " << number(grid.resolution_m)
                       << "\norigin: [" << number(grid.origin.x()) << ", "
                       << number(grid.origin.y()) << ", 0]\nnegate: 0\n"
                       << kThresholds;
  description.close();
}

}  // namespace unimapper::merge
