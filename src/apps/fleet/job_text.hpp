// Jobs of loop verification and their answers as JSON.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "src/merge/jobs/loop_job.hpp"

namespace unimapper::apps {

/// An outcome with the key of its question.
struct KeyedOutcome {
  std::string key;  ///< `merge::question_key`
  merge::LoopConstraint outcome;
};

/// What a worker says of a job.
struct JobAnswer {
  std::string job;                     ///< its name
  std::string worker;                  ///< its name
  std::string fault;                   ///< why there are no outcomes; empty: there are
  std::vector<KeyedOutcome> outcomes;  ///< one for each question, in their order
};

/// A job as JSON; `job_from` reads it back to the bit.
std::string job_text(const merge::LoopJob& job);
/// Throws std::runtime_error for what is none, with the reason.
merge::LoopJob job_from(std::string_view text);

/// An answer as JSON; `answer_from` reads it back to the bit.
std::string answer_text(const JobAnswer& answer);
/// Throws std::runtime_error for what is none, with the reason.
JobAnswer answer_from(std::string_view text);

}  // namespace unimapper::apps
