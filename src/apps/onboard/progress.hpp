// Progress output of long runs.
#pragma once

#include <cstddef>
#include <string>

namespace unimapper::apps {

/// Lines on stderr: one that is overwritten on a terminal, one every tenth elsewhere.
class Progress {
 public:
  /// `what` starts every line; `total` steps are to come.
  Progress(std::string what, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` steps are finished; `detail` ends the line.
  void update(std::size_t done, const std::string& detail);
  /// Prints a line of its own, e.g. a warning.
  void note(const std::string& line);

 private:
  void end_line();

  std::string what_;
  std::size_t total_;
  bool is_terminal_;
  bool line_open_ = false;
  std::size_t tenth_ = 0;
};

}  // namespace unimapper::apps
