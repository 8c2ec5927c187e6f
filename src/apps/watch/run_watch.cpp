// `unimapper watch`: keyframes of a share as they come.
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/reader.hpp"
#include "src/apps/print.hpp"
#include "src/apps/watch/keyframe_text.hpp"
#include "src/apps/watch/shares.hpp"
#include "src/apps/watch/watch_options.hpp"

namespace unimapper::apps {

using namespace shared_memory;

namespace {

using Clock = std::chrono::steady_clock;

/// The share to watch; empty if there is none yet. Throws where the user has to choose.
std::string chosen_share(const std::string& name) {
  if (!name.empty()) return name;
  const std::vector<std::string> names = list_shares();
  if (names.size() < 2) return names.empty() ? "" : names.front();
  std::string all;
  for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
  throw std::runtime_error("several robots share: " + all + "; name one");
}

/// Opens the keyframes, as soon as there are any. Throws if there are none in time.
std::string open_keyframes(const WatchOptions& options, Reader& reader) {
  ReaderOptions from;
  from.content = content_of(ContentKind::kKeyframe);
  if (options.from_oldest) from.start = ReaderOptions::Start::kOldest;
  const auto end = Clock::now() + std::chrono::duration<double>(options.wait_s);
  for (;;) {
    std::string name = chosen_share(options.name);
    const Outcome opened = reader.open(name, kKeyframeTopic, from);
    if (opened.ok) return name;
    const bool may_come = opened.error_number == ENOENT || opened.error_number == EAGAIN;
    if (!may_come) throw std::runtime_error(name + ": " + opened.message);
    if (Clock::now() >= end) {
      throw std::runtime_error(options.name.empty()
                                   ? "no robot on this computer shares its keyframes (--share)"
                                   : name + ": " + opened.message);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

/// The latest health of the share, if it tells.
class Health {
 public:
  explicit Health(const std::string& share) {
    ReaderOptions options;
    options.content = content_of(ContentKind::kHealth);
    (void)reader_.open(share, kHealthTopic, options).ok;
  }
  [[nodiscard]] std::vector<std::string> lines() {
    if (reader_.is_open() && reader_.take_latest(sample_) == Taken::kMessage) {
      if (const auto health = read_health(sample_.bytes())) lines_ = health_lines(*health);
    }
    return lines_;
  }

 private:
  Reader reader_;
  Sample sample_;
  std::vector<std::string> lines_;
};

/// Overwrites what was shown before.
void show_on_terminal(const std::string& name, const KeyframeMessage& keyframe,
                      std::uint32_t missed, Health& health) {
  winsize size{};
  (void)ioctl(STDOUT_FILENO, TIOCGWINSZ, &size);
  std::vector<std::string> lines{"robot     " + name};
  for (std::string& line : keyframe_lines(keyframe, missed)) lines.push_back(std::move(line));
  for (std::string& line : health.lines()) lines.push_back(std::move(line));
  const std::size_t columns = std::clamp<std::size_t>(size.ws_col, 40, 120);
  const std::size_t used = lines.size() + 1;
  const std::size_t rows = size.ws_row > used + 8 ? size.ws_row - used : 8;
  constexpr double kMetres = 60.0;
  for (std::string& line :
       view_from_above(keyframe, columns, std::min<std::size_t>(rows, 40), kMetres)) {
    lines.push_back(std::move(line));
  }
  std::fputs("\033[H\033[J", stdout);
  for (const std::string& line : lines) print_to(stdout, "{}\n", line);
  std::fflush(stdout);
}

}  // namespace

void run_watch(const WatchOptions& options) {
  Reader reader;
  const std::string name = open_keyframes(options, reader);
  Health health(name);
  const bool is_terminal = isatty(STDOUT_FILENO) == 1;
  std::uint64_t shown = 0;
  while (options.keyframes == 0 || shown < options.keyframes) {
    Sample sample;
    const bool had_writer = reader.has_writer() && !reader.is_replaced();
    if (!reader.wait(500'000'000)) {
      // What was published before the end has been shown.
      if (!had_writer) break;
      continue;
    }
    const Taken taken = reader.take(sample);
    if (taken == Taken::kFailed) throw std::runtime_error(name + ": the lease cannot be written");
    if (taken != Taken::kMessage) continue;
    const std::optional<KeyframeMessage> keyframe = read_keyframe(sample.bytes());
    if (!keyframe) throw std::runtime_error(name + ": what is shared there is no keyframe");
    ++shown;
    if (is_terminal) {
      show_on_terminal(name, *keyframe, reader.missed(), health);
    } else {
      print_to(stdout, "{}\n", keyframe_line(*keyframe, reader.missed()));
      std::fflush(stdout);
    }
  }
  if (!is_terminal) {
    for (const std::string& line : health.lines()) print_to(stdout, "{}\n", line);
  }
}

}  // namespace unimapper::apps
