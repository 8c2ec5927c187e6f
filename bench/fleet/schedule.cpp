// List scheduling of the loop verification of one merge, with measured times
//
//   fleet_schedule LOG...   keyframe logs of the sessions
//
// Merges them; every job is done once by one worker of one thread, and its processor time is taken:
// of reading a keyframe as it is, of a loop and a cloud by least squares over the jobs. Then the
// same jobs are taken, lane by lane, by 1 to 64 workers that share a link to the server. Prints a
// line for each number: "workers s speedup clouds busy_percent s_without_link s_without_clouds".
// What the merge does itself is in none of them.
#include <Eigen/Dense>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "bench/fleet/list_schedule.hpp"
#include "ports/lcm/received_log.hpp"
#include "src/merge/jobs/loop_worker.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "unimapper/merge/keyframe_level.hpp"
#include "unimapper/merge/merger.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::bench;
using namespace unimapper::merge;

namespace {

constexpr double kLinkBytesPerS = 1e9 / 8.0;

double seconds_since(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Outcomes by a worker in this process, whose jobs are kept with their times.
class TimedWorker final : public LoopOutcomes {
 public:
  TimedWorker(const std::vector<SessionData>& sessions, const MergeConfig& config)
      : sessions_(sessions),
        config_(config),
        worker_([this](const std::string& name) { return read(name); }, 1ULL << 32U, 1) {}

  std::optional<LoopConstraint> find(const LoopQuestion& /*question*/) override { return {}; }
  std::optional<PlacementEvidence> find(const PlacementQuestion& /*question*/) override {
    return {};
  }
  void keep(std::span<const Entry> /*entries*/) override {}
  void keep(const PlacementQuestion& /*question*/, const PlacementEvidence& /*evidence*/) override {
  }

  std::vector<LoopConstraint> verify(std::span<const LoopQuestion> questions,
                                     const CorrectionLimit& limit,
                                     const VerifyHere& verify_here) override {
    LoopJob common;
    common.merge = "one";
    common.config = config_;
    common.limit = limit;
    std::vector<LoopConstraint> outcomes(questions.size());
    std::vector<bool> done(questions.size());
    calls_.emplace_back();
    for (PlacedJob& placed :
         make_jobs(sessions_, questions, common, [this](KeyframeId k) { return publish(k); })) {
      const std::vector<LoopConstraint> answered = timed(placed);
      for (std::size_t i = 0; i < answered.size(); ++i) {
        outcomes[placed.positions[i]] = answered[i];
        done[placed.positions[i]] = true;
      }
    }
    for (std::size_t i = 0; i < questions.size(); ++i) {
      if (!done[i]) outcomes[i] = verify_here(std::span(&i, 1)).front();
    }
    return outcomes;
  }

  /// Jobs of each call; all of a call are answered before the next one.
  [[nodiscard]] const std::vector<std::vector<Job>>& calls() const { return calls_; }
  [[nodiscard]] std::uint64_t bytes(KeyframeId k) const { return encoded_.at(name(k)).size(); }

  [[nodiscard]] Costs costs() const {
    Eigen::MatrixX2d counts(static_cast<Eigen::Index>(times_s_.size()), 2);
    Eigen::VectorXd times(counts.rows());
    std::set<KeyframeId> known;
    Eigen::Index row = 0;
    for (const std::vector<Job>& jobs : calls_) {
      for (const Job& job : jobs) {
        std::size_t clouds = 0;
        for (const KeyframeId k : job.clouds) clouds += known.insert(k).second ? 1 : 0;
        counts.row(row) << static_cast<double>(job.loops), static_cast<double>(clouds);
        times[row] = times_s_[static_cast<std::size_t>(row)];
        ++row;
      }
    }
    const Eigen::Vector2d parts = counts.colPivHouseholderQr().solve(times);
    return {read_s_ / static_cast<double>(reads_), parts[1], parts[0]};
  }

 private:
  static std::string name(KeyframeId k) {
    return std::to_string(k.session) + ":" + std::to_string(k.keyframe);
  }
  std::string publish(KeyframeId k) {
    std::vector<std::uint8_t>& bytes = encoded_[name(k)];
    if (bytes.empty()) bytes = wire::encode_keyframe(sessions_[k.session].keyframes[k.keyframe]);
    return name(k);
  }
  KeyframeRecord read(const std::string& name) {
    const std::clock_t start = std::clock();
    KeyframeRecord record = std::move(*wire::decode_keyframe(encoded_.at(name)).record);
    const double s = seconds_since(start);
    read_s_ += s;
    read_of_job_s_ += s;
    ++reads_;
    return record;
  }
  std::vector<LoopConstraint> timed(const PlacedJob& placed) {
    const LoopJob& job = placed.job;
    Job kept;
    kept.lane = placed.lane;
    for (const LoopQuestion& question : job.questions)
      kept.clouds.insert({question.query, question.match});
    for (const KeyframeId k : kept.clouds) {
      for (const std::size_t i : submap_of(sessions_[k.session], k.keyframe).keyframes) {
        kept.read.insert({k.session, i});
      }
    }
    kept.loops = job.questions.size();
    calls_.back().push_back(std::move(kept));
    read_of_job_s_ = 0.0;
    const std::clock_t start = std::clock();
    std::vector<LoopConstraint> answered = worker_.answer(job);
    times_s_.push_back(seconds_since(start) - read_of_job_s_);
    return answered;
  }

  const std::vector<SessionData>& sessions_;
  MergeConfig config_;
  LoopWorker worker_;
  std::map<std::string, std::vector<std::uint8_t>> encoded_;
  std::vector<std::vector<Job>> calls_;
  std::vector<double> times_s_;  ///< of all jobs, without reading
  double read_s_ = 0.0;
  double read_of_job_s_ = 0.0;
  std::size_t reads_ = 0;
};

void print(const TimedWorker& merge) {
  const Costs costs = merge.costs();
  std::size_t jobs = 0;
  std::size_t loops = 0;
  for (const auto& call : merge.calls()) {
    jobs += call.size();
    for (const Job& job : call) loops += job.loops;
  }
  std::printf("%zu loops, %zu jobs, %zu rounds; ms a keyframe %.1f, a cloud %.1f, a loop %.1f\n",
              loops, jobs, merge.calls().size(), 1e3 * costs.keyframe, 1e3 * costs.cloud,
              1e3 * costs.loop);
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const auto with = [&](std::size_t workers, const Costs& each, double link_bytes_per_s) {
    return scheduled(
        merge.calls(), [&](KeyframeId k) { return merge.bytes(k); }, workers, each,
        link_bytes_per_s);
  };
  const double alone_s = with(1, costs, kLinkBytesPerS).end_s;
  for (const std::size_t workers : {1, 2, 4, 16, 64}) {
    const Schedule schedule = with(workers, costs, kLinkBytesPerS);
    const double no_link_s = with(workers, costs, kNoLimit).end_s;
    const double no_clouds_s = with(workers, {0.0, 0.0, costs.loop}, kLinkBytesPerS).end_s;
    std::printf("%zu %.2f %.1f %zu %.0f %.2f %.2f\n", workers, schedule.end_s,
                alone_s / schedule.end_s, schedule.clouds,
                100.0 * schedule.busy_s / (static_cast<double>(workers) * schedule.end_s),
                no_link_s, no_clouds_s);
  }
}

std::vector<SessionData> read_sessions(int count, char** logs) {
  std::vector<SessionData> sessions;
  for (int i = 0; i < count; ++i) {
    for (SessionData& session : lcm_port::read_event_log(logs[i]).sessions) {
      (void)level_keyframes(session);
      sessions.push_back(std::move(session));
    }
  }
  return sessions;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::invalid_argument("usage: fleet_schedule LOG...");
    const std::vector<SessionData> sessions = read_sessions(argc - 1, argv + 1);
    MergeConfig config;
    config.threads = 1;
    TimedWorker outcomes(sessions, config);
    (void)merge_poses(sessions, config, {}, {}, &outcomes);
    print(outcomes);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fleet_schedule: %s\n", error.what());
    return 1;
  }
}
