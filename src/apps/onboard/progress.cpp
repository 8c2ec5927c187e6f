#include "src/apps/onboard/progress.hpp"

#include <unistd.h>

#include <cstdio>

namespace unimapper::apps {

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), is_terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { end_line(); }

void Progress::update(std::size_t done, const std::string& detail) {
  const std::size_t tenth = total_ == 0 ? 10 : 10 * done / total_;
  if (!is_terminal_ && tenth == tenth_) return;
  tenth_ = tenth;
  std::fprintf(stderr, is_terminal_ ? "\r\033[K%s: %zu/%zu scans, %s" : "%s: %zu/%zu scans, %s\n",
               what_.c_str(), done, total_, detail.c_str());
  std::fflush(stderr);
  line_open_ = is_terminal_;
}

void Progress::note(const std::string& line) {
  end_line();
  std::fprintf(stderr, "%s: %s\n", what_.c_str(), line.c_str());
}

void Progress::end_line() {
  if (line_open_) std::fputc('\n', stderr);
  line_open_ = false;
}

}  // namespace unimapper::apps
