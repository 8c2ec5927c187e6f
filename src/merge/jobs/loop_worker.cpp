// Loop verification of jobs, with what the jobs of one merge share.
#include "loop_worker.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "src/merge/loops/loop_fingerprint.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/sessions/keyframe_cache.hpp"

namespace unimapper::merge {
/// Keyframes that jobs of one merge named. A keyframe that none did is a summary, which joins no
/// cloud: so those that are named have the neighbours that they have in the merge.
class LoopWorker::OfMerge {
 public:
  OfMerge(const LoopJob& job, ReadNamedKeyframe read, std::uint64_t max_bytes,
          std::uint32_t threads)
      : name_(job.merge),
        config_(with_threads(job.config, threads)),
        read_(std::move(read)),
        cache_(max_bytes / 2),
        clouds_(sessions_, config_.registration, config_.threads, max_bytes / 2),
        prints_(sessions_, config_) {}

  [[nodiscard]] const std::string& name() const { return name_; }

  std::vector<LoopConstraint> answer(const LoopJob& job, const std::function<void()>& progress) {
    for (const JobKeyframe& keyframe : job.keyframes) take(keyframe);
    std::vector<LoopCandidate> candidates;
    for (const LoopQuestion& question : job.questions) {
      if (!is_known(question.query) || !is_known(question.match)) {
        throw std::runtime_error("the job lacks a keyframe of its questions");
      }
      if (prints_.of(question.query, question.match, job.limit) != question.fingerprint) {
        throw std::runtime_error(
            "its keyframes, or the verification here, are not those of the merge");
      }
      LoopCandidate candidate;
      candidate.query = question.query;
      candidate.match = question.match;
      candidate.T_match_query = question.T_match_query;
      candidates.push_back(candidate);
    }
    std::vector<LoopConstraint> outcomes;
    const std::span all(candidates);
    for (std::size_t begin = 0; begin < all.size(); begin += kAtOnce) {
      const auto some = all.subspan(begin, std::min(kAtOnce, all.size() - begin));
      for (LoopConstraint& loop : verify_loops(some, job.limit, clouds_, config_)) {
        outcomes.push_back(std::move(loop));
      }
      if (progress) progress();
    }
    return outcomes;
  }

 private:
  /// Loops between two words of progress, which are for a second.
  static constexpr std::size_t kAtOnce = 8;

  /// Names of the keyframes of one session, by their number in the merge.
  class Names {
   public:
    void set(std::uint32_t sequence, std::string name) {
      const std::lock_guard<std::mutex> lock(guard_);
      names_[sequence] = std::move(name);
    }
    [[nodiscard]] std::string get(std::uint32_t sequence) const {
      const std::lock_guard<std::mutex> lock(guard_);
      return names_.at(sequence);
    }

   private:
    mutable std::mutex guard_;
    std::map<std::uint32_t, std::string> names_;
  };

  static MergeConfig with_threads(MergeConfig config, std::uint32_t threads) {
    config.threads = threads;
    return config;
  }

  [[nodiscard]] bool is_known(KeyframeId k) const {
    return k.session < sessions_.size() && k.keyframe < sessions_[k.session].keyframes.size() &&
           !sessions_[k.session].keyframes[k.keyframe].is_summary;
  }

  /// Of all sessions together: a forged job takes no more memory than 200 MB.
  static constexpr std::size_t kMostKeyframes = 500'000;

  void take(const JobKeyframe& wanted) {
    if (is_known(wanted.id)) return;
    std::size_t held = 0;
    for (const SessionData& session : sessions_) held += 1 + session.keyframes.size();
    if (held + wanted.id.session + wanted.id.keyframe > kMostKeyframes) {
      throw std::runtime_error("the job names a keyframe beyond all limits");
    }
    while (sessions_.size() <= wanted.id.session) add_session();
    SessionData& session = sessions_[wanted.id.session];
    // Read when a cloud needs it: most neighbours join none.
    KeyframeRecord keyframe;
    keyframe.sequence = wanted.id.keyframe;
    keyframe.T_odometry_keyframe = wanted.T_odometry_keyframe;
    keyframe.up = wanted.up;
    names_[wanted.id.session]->set(keyframe.sequence, wanted.name);
    if (session.keyframes.size() <= wanted.id.keyframe) {
      KeyframeRecord unknown;
      unknown.is_summary = true;
      session.keyframes.resize(wanted.id.keyframe + 1, unknown);
      // Sizes alone: nothing is forgotten.
      prints_.forget_from(wanted.id.session, session.keyframes.size(), session.keyframes.size());
    }
    session.keyframes[wanted.id.keyframe] = std::move(keyframe);
  }

  void add_session() {
    const auto names = names_.emplace_back(std::make_shared<Names>());
    SessionData session;
    session.contents = cache_.contents(
        [names, read = read_](std::uint32_t sequence) { return read(names->get(sequence)); });
    sessions_.push_back(std::move(session));
    clouds_.forget_from(sessions_.size() - 1, 0);
    prints_.forget_from(sessions_.size() - 1, 0, 0);
  }

  std::string name_;
  MergeConfig config_;
  ReadNamedKeyframe read_;
  KeyframeCache cache_;
  std::vector<SessionData> sessions_;
  std::vector<std::shared_ptr<Names>> names_;
  KeyframeClouds clouds_;
  LoopFingerprints prints_;
};

LoopWorker::LoopWorker(ReadNamedKeyframe read, std::uint64_t max_bytes, std::uint32_t threads)
    : read_(std::move(read)), max_bytes_(max_bytes), threads_(threads) {}

LoopWorker::~LoopWorker() = default;

std::vector<LoopConstraint> LoopWorker::answer(const LoopJob& job,
                                               const std::function<void()>& progress) {
  if (merge_ == nullptr || merge_->name() != job.merge) {
    merge_.reset();  // its memory first
    merge_ = std::make_unique<OfMerge>(job, read_, max_bytes_, threads_);
  }
  return merge_->answer(job, progress);
}

}  // namespace unimapper::merge
