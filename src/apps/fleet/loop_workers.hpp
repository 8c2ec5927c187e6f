// Verification of loops by workers on other machines.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "ports/nats/job_board.hpp"
#include "src/apps/fleet/job_text.hpp"

namespace unimapper::apps {

/// How questions become jobs, and how long answers are waited for.
struct LoopWorkersOptions {
  std::string salt;                   ///< known to nobody else: it says which answers are compared
  std::string merge;                  ///< names the merge for workers
  merge::JobSizes sizes;              ///< of jobs
  std::chrono::seconds patience{70};  ///< without any answer; then all is verified here
};

/// Has loops verified by whoever takes jobs off the board. What nobody has taken, and what is less
/// than one large job, is verified here. Outcomes are the same to the bit whoever computed them: of
/// each worker the first job is verified here as well, and then one question of 64. A worker that
/// answers otherwise is not trusted, and its answers of that call are verified here. Not thread
/// safe.
class LoopWorkers {
 public:
  /// Makes the bytes of a keyframe available under the name that it returns.
  using Publish = std::function<std::string(KeyframeId)>;
  using Say = std::function<void(const std::string&)>;

  /// `board` must outlive it; `say` takes warnings.
  LoopWorkers(nats_port::JobBoard& board, LoopWorkersOptions options, Say say);

  /// As `LoopOutcomes::verify`.
  std::vector<merge::LoopConstraint> verify(const std::vector<SessionData>& sessions,
                                            const merge::MergeConfig& config,
                                            const Publish& publish,
                                            std::span<const merge::LoopQuestion> questions,
                                            const merge::CorrectionLimit& limit,
                                            const merge::VerifyHere& verify_here);

  /// How many loops were verified by others, and by whom, in words.
  [[nodiscard]] std::string text() const;

 private:
  class Call;
  struct Known {
    std::string worker;
    merge::LoopConstraint outcome;
  };

  /// Says a warning once.
  void say_once(const std::string& text);
  /// Nothing for what is no answer, which is said.
  std::optional<JobAnswer> parsed(const std::string& text);
  void distrust(const std::string& worker, const std::string& why);
  /// Answers that are kept from before, and late ones.
  void remember(JobAnswer&& answer);

  nats_port::JobBoard& board_;
  LoopWorkersOptions options_;
  Say say_;
  bool is_begun_ = false;
  bool is_board_lost_ = false;
  std::uint64_t calls_ = 0;
  std::map<std::string, Known> known_;             ///< outcomes that nobody waits for, by key
  std::map<std::string, std::uint64_t> used_;      ///< outcomes used, by worker
  std::map<std::string, std::uint64_t> compared_;  ///< outcomes verified here as well, by worker
  std::set<std::string> distrusted_;
  std::set<std::string> said_;
};

}  // namespace unimapper::apps
