#include "src/apps/fleet/worker.hpp"

#include <exception>
#include <stdexcept>
#include <utility>

#include "src/apps/fleet/job_text.hpp"
#include "src/apps/prometheus_text.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::apps {

FleetWorker::FleetWorker(std::string name, KeyframeFiles& files, std::uint64_t max_bytes,
                         std::uint32_t threads)
    : name_(std::move(name)),
      files_(files),
      worker_(
          [this](const std::string& keyframe) {
            const auto bytes = files_.get(keyframe, [&](const std::string& n) {
              ++counters_.keyframes;
              return source_->keyframe(n);
            });
            source_->tell_progress();
            wire::DecodedKeyframe decoded = wire::decode_keyframe(bytes);
            if (!decoded.record)
              throw std::runtime_error("a keyframe is damaged: " + decoded.error);
            return std::move(*decoded.record);
          },
          max_bytes, threads) {}

std::size_t FleetWorker::work(nats_port::JobSource& source, std::chrono::milliseconds wait) {
  source_ = &source;
  const auto taken = source.next_job(wait);
  if (!taken) return 0;
  const auto start = std::chrono::steady_clock::now();
  JobAnswer answer;
  answer.worker = name_;
  try {
    const merge::LoopJob job = job_from(*taken);
    answer.job = job.name;
    const std::vector<merge::LoopConstraint> outcomes =
        worker_.answer(job, [&] { source.tell_progress(); });
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      answer.outcomes.push_back({merge::question_key(job.questions[i]), outcomes[i]});
    }
  } catch (const std::exception& error) {
    answer.fault = error.what();
  }
  source.answer(answer_text(answer));
  ++counters_.jobs;
  counters_.loops += answer.outcomes.size();
  counters_.faults += answer.fault.empty() ? 0 : 1;
  counters_.job_times.add(std::chrono::steady_clock::now() - start);
  return answer.outcomes.size();
}

std::string metrics_text(const WorkerCounters& counters) {
  PrometheusText text;
  text.count("worker_loops_total", "Loops verified", counters.loops);
  text.count("worker_jobs_total", "Jobs answered", counters.jobs);
  text.count("worker_faults_total", "Jobs that could not be done", counters.faults);
  text.count("worker_keyframes_total", "Keyframes fetched from the server", counters.keyframes);
  text.count("worker_failures_total", "Connections that ended with a reason", counters.failures);
  text.times("worker_job_seconds", "From the arrival of a job to its answer", counters.job_times);
  return text.take();
}

}  // namespace unimapper::apps
