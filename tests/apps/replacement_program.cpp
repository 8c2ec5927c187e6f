// Process that replaces a map again and again, for the test that kills it.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <string>

#include "src/apps/replacement.hpp"

namespace fs = std::filesystem;
using namespace unimapper::apps;

namespace {

void write(const fs::path& file, const std::string& text, int lines) {
  fs::create_directories(file.parent_path());
  std::ofstream stream(file);
  for (int i = 0; i < lines; ++i) stream << text << '\n';
}

/// Map number `number`: each file says so, and one has it in its name.
void write_map(const fs::path& folder, const std::string& number) {
  write(folder / "map.ply", number, 20000);
  write(folder / "summary.json", number, 1);
  write(folder / "trajectories" / (number + ".tum"), number, 100);
}

}  // namespace

// replacement_program FOLDER FIRST: prints the number of every map that is published.
int main(int argc, char** argv) {
  if (argc != 3) return 2;
  try {
    for (int number = std::atoi(argv[2]);; ++number) {
      FolderReplacement map(argv[1], Output::kMap);
      write_map(map.path(), std::to_string(number));
      map.publish();
      std::printf("%d\n", number);
      if (std::fflush(stdout) != 0) return 0;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
