// Delay of merges while robots drive, by processor time: a finished store is received once more.
//
//   merge_live_replay STORE FOLDER [SHARE]
//
// Keyframes of all sessions of STORE arrive in a new store in FOLDER at the pace of their stamps,
// all robots starting together. The clock is a simulated one: a merge takes as long as the
// processor time that it used, divided by SHARE (1: a processor of its own). Prints a line for each
// merge, and the delay of a keyframe at most.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <vector>

#include "ports/store/keyframe_store.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/base/live_merge.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;

namespace {

using Clock = apps::LiveMerge::Clock;

struct Arrival {
  std::chrono::nanoseconds after{};
  std::vector<std::uint8_t> bytes;
};

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double in_seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

/// In order of time.
std::vector<Arrival> arrivals_of(store::StoreReader& reader,
                                 const std::vector<store::SessionListing>& sessions) {
  std::vector<Arrival> arrivals;
  for (const store::SessionListing& session : sessions) {
    reader.for_each_keyframe(session, [&](store::StoredKeyframe&& stored) {
      const wire::DecodedKeyframe decoded = wire::decode_keyframe(stored.bytes);
      if (!decoded.record) return;
      const std::int64_t stamp_ns = decoded.record->scans.back().stamp_ns;
      arrivals.push_back(
          {std::chrono::nanoseconds(stamp_ns - session.first_stamp_ns), std::move(stored.bytes)});
    });
  }
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.after < b.after; });
  return arrivals;
}

class Replay {
 public:
  Replay(const std::filesystem::path& from, const std::filesystem::path& folder, double share)
      : reader_(from),
        sessions_(reader_.sessions()),
        arrivals_(arrivals_of(reader_, sessions_)),
        kept_(folder),
        share_(share) {
    apps::LiveMergeOptions options;
    options.store = folder;
    options.config.threads = 1;
    options.answered = [](const wire::MapPoseMessage&) {};
    options.forgotten = [](const SessionId&) {};
    options.report = [](const std::string& text) { std::printf("%s\n", text.c_str()); };
    live_.emplace(std::move(options), kept_.lock());
  }

  void run() {
    while (arrived_ < arrivals_.size()) {
      receive();
      advance([&] { live_->advance([&] { return now(); }); });
      time_ += std::chrono::milliseconds(200);
    }
    for (const store::SessionListing& session : sessions_) {
      kept_.keep(wire::SessionSummary{session.info.id, session.info, true, session.keyframes, 0});
    }
    (void)kept_.commit_all(++commits_);
    advance([&] { live_->finish([&] { return now(); }); });
    const apps::LiveMergeCounters& counters = live_->counters();
    std::printf(
        "%llu merges, %llu of them by keyframes, %.1f s the longest, delay %.1f s at most; "
        "%.1f s of processor time; all loops at the end took %.1f s\n",
        static_cast<unsigned long long>(counters.merges),
        static_cast<unsigned long long>(counters.growths), in_seconds(counters.longest_merge),
        in_seconds(counters.longest_effect), spent_, in_seconds(counters.complete) * share_);
  }

 private:
  [[nodiscard]] Clock::time_point now() const {
    const double used = processor_seconds() - since_;
    return Clock::time_point(time_) + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(used / share_));
  }

  void receive() {
    const std::size_t before = arrived_;
    while (arrived_ < arrivals_.size() && arrivals_[arrived_].after <= time_) {
      std::vector<std::uint8_t>& bytes = arrivals_[arrived_++].bytes;
      KeyframeRecord record = *wire::decode_keyframe(bytes).record;
      (void)kept_.keep(wire::ReceivedKeyframe{std::move(bytes), std::move(record)});
    }
    if (arrived_ == before) return;
    for (const store::SessionListing& session : sessions_) {
      kept_.keep(wire::SessionSummary{session.info.id, session.info, false, 0, 0});
    }
    (void)kept_.commit_all(++commits_);
  }

  template <typename Work>
  void advance(const Work& work) {
    const std::uint64_t merges = live_->counters().merges;
    since_ = processor_seconds();
    work();
    last_ = processor_seconds() - since_;
    spent_ += last_;
    if (live_->counters().merges != merges) {
      std::printf("%7.2f s: %3zu keyframes, %.2f s\n", std::chrono::duration<double>(time_).count(),
                  arrived_, last_);
    }
    time_ += std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(last_ / share_));
  }

  store::StoreReader reader_;
  std::vector<store::SessionListing> sessions_;
  std::vector<Arrival> arrivals_;
  store::KeyframeStore kept_;
  std::optional<apps::LiveMerge> live_;
  double share_;
  std::size_t arrived_ = 0;
  std::int64_t commits_ = 0;
  std::chrono::nanoseconds time_{};
  double since_ = 0.0;
  double last_ = 0.0;
  double spent_ = 0.0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::puts("merge_live_replay STORE FOLDER [SHARE]"), 2;
  try {
    Replay(argv[1], argv[2], argc > 3 ? std::atof(argv[3]) : 1.0).run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "merge_live_replay: %s\n", error.what());
    return 1;
  }
  return 0;
}
