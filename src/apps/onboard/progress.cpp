#include "src/apps/onboard/progress.hpp"

#include <unistd.h>

#include <cstdio>

#include "src/apps/print.hpp"

namespace unimapper::apps {

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), is_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { end_line(); }

void Progress::update(std::size_t done, const std::string& detail) {
  const std::size_t tenth = total_ == 0 ? 10 : 10 * done / total_;
  if (!is_terminal_ && tenth == tenth_) return;
  tenth_ = tenth;
  print_to(stderr, "{}{}: {}/{} scans, {}{}", is_terminal_ ? "\r\033[K" : "", what_, done, total_,
           detail, is_terminal_ ? "" : "\n");
  std::fflush(stderr);
  line_open_ = is_terminal_;
}

void Progress::note(const std::string& line) {
  end_line();
  print_to(stderr, "{}: {}\n", what_, line);
}

void Progress::end_line() {
  if (line_open_) std::fputc('\n', stderr);
  line_open_ = false;
}

}  // namespace unimapper::apps
