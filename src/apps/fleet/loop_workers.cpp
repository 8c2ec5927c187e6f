#include "src/apps/fleet/loop_workers.hpp"

#include <algorithm>
#include <exception>
#include <optional>
#include <tuple>
#include <utility>

namespace unimapper::apps {
namespace {

using Clock = std::chrono::steady_clock;
using merge::LoopConstraint;
using merge::LoopQuestion;

/// Questions of a worker that are verified here as well: the first ones, then one of so many.
constexpr std::uint64_t kFirstCompared = 8;
constexpr std::uint64_t kComparedOf = 64;

/// How long answers of earlier merges may take to begin and to go on.
constexpr std::chrono::milliseconds kKeptAnswersWait{100};
constexpr std::chrono::milliseconds kAnswerWait{500};

/// Outcomes that nobody waits for, kept in about 100 MB.
constexpr std::size_t kMostKnown = 200'000;

bool are_equal(const LoopConstraint& a, const LoopConstraint& b) {
  return a.T_match_query.rotation == b.T_match_query.rotation &&
         a.T_match_query.translation == b.T_match_query.translation &&
         a.information == b.information && a.overlap == b.overlap &&
         a.decision.accepted == b.decision.accepted && a.decision.reason == b.decision.reason;
}

/// One of `kComparedOf` keys; a worker cannot know which.
bool is_sampled(const std::string& key, const std::string& salt) {
  return std::hash<std::string>{}(salt + key) % kComparedOf == 0;
}

}  // namespace

/// Questions that are verified together.
class LoopWorkers::Call {
 public:
  Call(LoopWorkers& workers, const std::vector<SessionData>& sessions,
       std::span<const LoopQuestion> questions, const merge::VerifyHere& verify_here)
      : workers_(workers),
        sessions_(sessions),
        questions_(questions),
        verify_here_(verify_here),
        outcomes_(questions.size()),
        by_(questions.size()) {
    for (const LoopQuestion& question : questions) keys_.push_back(question_key(question));
  }

  void use_known() {
    for (std::size_t i = 0; i < questions_.size(); ++i) {
      const auto known = workers_.known_.find(keys_[i]);
      if (known == workers_.known_.end()) continue;
      accept(known->second.worker, {i}, {{keys_[i], known->second.outcome}});
    }
  }

  void hand_out(const merge::LoopJob& common, const Publish& publish) {
    std::vector<LoopQuestion> open;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < questions_.size(); ++i) {
      if (outcomes_[i]) continue;
      open.push_back(questions_[i]);
      positions.push_back(i);
    }
    // Whoever takes them reads all their keyframes anew.
    if (open.size() < workers_.options_.sizes.most) return;
    auto jobs = make_jobs(sessions_, open, common, publish, workers_.options_.sizes);
    for (merge::PlacedJob& placed : jobs) {
      for (std::size_t& position : placed.positions) position = positions[position];
      const std::uint64_t number = workers_.board_.put_job(job_text(placed.job), placed.lane);
      jobs_.emplace(placed.job.name, Waiting{placed.lane, number, std::move(placed.positions)});
    }
  }

  /// Until every job was answered, taken back or given up.
  void gather() {
    Clock::time_point last_answer = Clock::now();
    while (!jobs_.empty()) {
      const auto text = workers_.board_.next_answer(std::chrono::milliseconds(0));
      const bool is_answered = text && take(*text);
      if (is_answered || set_some_aside() || take_one_back()) {
        last_answer = Clock::now();
        continue;
      }
      const auto waited_for = workers_.board_.next_answer(kAnswerWait);
      if (waited_for && take(*waited_for)) {
        last_answer = Clock::now();
      } else if (Clock::now() - last_answer > workers_.options_.patience) {
        workers_.say_once("workers have answered nothing for " +
                          std::to_string(workers_.options_.patience.count()) +
                          " s: loops are verified here");
        return;
      }
      // Nobody may have one any more.
      for (auto& [name, job] : jobs_) job.is_begun = false;
    }
  }

  std::vector<LoopConstraint> finish() {
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < outcomes_.size(); ++i) {
      if (!outcomes_[i]) open.push_back(i);
    }
    if (!open.empty()) compute(open);
    std::vector<LoopConstraint> all;
    all.reserve(outcomes_.size());
    for (std::size_t i = 0; i < outcomes_.size(); ++i) {
      if (!by_[i].empty()) ++workers_.used_[by_[i]];
      all.push_back(std::move(*outcomes_[i]));
    }
    return all;
  }

 private:
  struct Waiting {
    std::uint32_t lane = 0;
    std::uint64_t number = 0;
    std::vector<std::size_t> positions;
    bool is_begun = false;  ///< by a worker
  };

  void compute(const std::vector<std::size_t>& positions) {
    std::vector<LoopConstraint> outcomes = verify_here_(positions);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      outcomes_[positions[i]] = std::move(outcomes[i]);
      by_[positions[i]].clear();
    }
  }

  /// The last job of the last lane that nobody has begun: then the next one is likely beside it.
  bool take_one_back() {
    for (;;) {
      const auto rank = [](const auto& job) {
        return std::tuple(!job.second.is_begun, job.second.lane, job.second.number);
      };
      const auto last =
          std::max_element(jobs_.begin(), jobs_.end(),
                           [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
      if (last == jobs_.end() || last->second.is_begun) return false;
      if (workers_.board_.take_back(last->second.number, last->second.lane)) {
        const std::vector<std::size_t> positions = std::move(last->second.positions);
        jobs_.erase(last);
        compute(positions);
        return true;
      }
      for (auto& [name, job] : jobs_) {
        if (job.lane == last->second.lane && job.number <= last->second.number) job.is_begun = true;
      }
    }
  }

  /// False for what answers no open job.
  bool take(const std::string& text) {
    std::optional<JobAnswer> read = workers_.parsed(text);
    if (!read) return false;
    JobAnswer& answer = *read;
    const auto job = jobs_.find(answer.job);
    if (job == jobs_.end()) {
      workers_.remember(std::move(answer));
      return false;
    }
    const std::vector<std::size_t> positions = std::move(job->second.positions);
    jobs_.erase(job);
    if (!answer.fault.empty()) {
      workers_.say_once("worker " + answer.worker + ": " + answer.fault + "; verified here");
    } else {
      accept(answer.worker, positions, answer.outcomes);
    }
    return true;
  }

  /// False if the server has said so of none of the open jobs.
  bool set_some_aside() {
    bool is_any = false;
    for (const std::uint64_t number : workers_.board_.set_aside()) {
      const auto job = std::find_if(jobs_.begin(), jobs_.end(),
                                    [&](const auto& j) { return j.second.number == number; });
      if (job == jobs_.end()) continue;
      set_aside(job->second.positions);
      jobs_.erase(job);
      is_any = true;
    }
    return is_any;
  }

  void set_aside(const std::vector<std::size_t>& positions) {
    std::string names;
    for (const std::size_t i : positions) {
      const LoopQuestion& question = questions_[i];
      LoopConstraint& refused = outcomes_[i].emplace();
      refused.T_match_query = question.T_match_query;
      refused.decision.reason = merge::kSetAside;
      names +=
          (names.empty() ? "" : ", ") + name_of(question.query) + " - " + name_of(question.match);
    }
    workers_.say_once("loops are set aside, as their job ended " +
                      std::to_string(nats_port::kMostDeliveries) + " workers: " + names);
  }

  [[nodiscard]] std::string name_of(KeyframeId k) const {
    const SessionData& session = sessions_[k.session];
    return session.info.name + ":" + std::to_string(session.keyframes[k.keyframe].sequence);
  }

  void accept(const std::string& worker, const std::vector<std::size_t>& positions,
              const std::vector<KeyedOutcome>& answered) {
    if (workers_.distrusted_.count(worker) > 0) return;
    std::string fault;
    if (answered.size() != positions.size()) fault = "it has not one outcome for each loop";
    std::vector<std::size_t> compared;
    for (std::size_t i = 0; i < positions.size() && fault.empty(); ++i) {
      const std::string& key = keys_[positions[i]];
      fault = answered[i].key == key ? fault_of(answered[i].outcome) : "it answers other questions";
      std::uint64_t& count = workers_.compared_[worker];
      if (count >= kFirstCompared && !is_sampled(key, workers_.options_.salt)) continue;
      compared.push_back(i);
      ++count;
    }
    if (fault.empty()) fault = difference(positions, answered, compared);
    if (!fault.empty()) {
      workers_.distrust(worker, fault);
      forget(worker);
      return;
    }
    for (std::size_t i = 0; i < positions.size(); ++i) {
      outcomes_[positions[i]] = answered[i].outcome;
      by_[positions[i]] = worker;
    }
  }

  /// What is wrong with the answers that are verified here as well; empty: nothing.
  std::string difference(const std::vector<std::size_t>& positions,
                         const std::vector<KeyedOutcome>& answered,
                         const std::vector<std::size_t>& compared) {
    if (compared.empty()) return {};
    std::vector<std::size_t> chosen;
    for (const std::size_t i : compared) chosen.push_back(positions[i]);
    const std::vector<LoopConstraint> own = verify_here_(chosen);
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (!are_equal(own[i], answered[compared[i]].outcome)) {
        return "its outcomes differ from those of this machine";
      }
    }
    return {};
  }

  void forget(const std::string& worker) {
    for (std::size_t i = 0; i < outcomes_.size(); ++i) {
      if (by_[i] == worker) outcomes_[i].reset();
    }
  }

  LoopWorkers& workers_;
  const std::vector<SessionData>& sessions_;
  std::span<const LoopQuestion> questions_;
  const merge::VerifyHere& verify_here_;
  std::vector<std::string> keys_;
  std::vector<std::optional<LoopConstraint>> outcomes_;
  std::vector<std::string> by_;  ///< worker whose outcome it is; empty: verified here
  std::map<std::string, Waiting> jobs_;
};

LoopWorkers::LoopWorkers(nats_port::JobBoard& board, LoopWorkersOptions options, Say say)
    : board_(board), options_(std::move(options)), say_(std::move(say)) {}

std::vector<LoopConstraint> LoopWorkers::verify(const std::vector<SessionData>& sessions,
                                                const merge::MergeConfig& config,
                                                const Publish& publish,
                                                std::span<const LoopQuestion> questions,
                                                const merge::CorrectionLimit& limit,
                                                const merge::VerifyHere& verify_here) {
  Call call(*this, sessions, questions, verify_here);
  try {
    if (!is_begun_) {
      is_begun_ = true;
      while (const auto text = board_.next_answer(kKeptAnswersWait)) {
        if (auto answer = parsed(*text)) remember(std::move(*answer));
      }
    }
    call.use_known();
    merge::LoopJob common;
    common.name = options_.merge + "-" + std::to_string(calls_++) + "-";
    common.merge = options_.merge;
    common.config = config;
    common.limit = limit;
    if (!is_board_lost_) call.hand_out(common, publish);
    call.gather();
  } catch (const nats_port::NatsError& error) {
    is_board_lost_ = true;
    say_once(std::string(error.what()) + ": loops are verified here");
  }
  return call.finish();
}

std::string LoopWorkers::text() const {
  std::string text;
  for (const auto& [worker, count] : used_) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " loops by " + worker;
  }
  return text.empty() ? "no loop was verified by workers" : "verified by workers: " + text;
}

void LoopWorkers::say_once(const std::string& text) {
  if (said_.insert(text).second) say_(text);
}

std::optional<JobAnswer> LoopWorkers::parsed(const std::string& text) {
  try {
    return answer_from(text);
  } catch (const std::exception& error) {
    say_once(error.what());
    return std::nullopt;
  }
}

void LoopWorkers::distrust(const std::string& worker, const std::string& why) {
  distrusted_.insert(worker);
  say_once("worker " + worker + " is not trusted: " + why);
}

void LoopWorkers::remember(JobAnswer&& answer) {
  for (KeyedOutcome& keyed : answer.outcomes) {
    if (known_.size() >= kMostKnown) return;
    known_.try_emplace(keyed.key, Known{answer.worker, std::move(keyed.outcome)});
  }
}

}  // namespace unimapper::apps
