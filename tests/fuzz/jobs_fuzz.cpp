// Fuzz target of jobs and answers of a fleet: what is read comes back from what is written.
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "src/apps/fleet/job_text.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace unimapper;
using fuzz::require;

void read_job(std::string_view text) {
  fuzz::allow_refusal<std::runtime_error>([&] {
    const merge::LoopJob job = apps::job_from(text);
    require(job.config.validate().ok());
    const std::string written = apps::job_text(job);
    require(apps::job_text(apps::job_from(written)) == written);
    for (const merge::LoopQuestion& question : job.questions) {
      require(merge::question_key(question).size() == 32);
    }
  });
}

void read_answer(std::string_view text) {
  fuzz::allow_refusal<std::runtime_error>([&] {
    const apps::JobAnswer answer = apps::answer_from(text);
    const std::string written = apps::answer_text(answer);
    require(apps::answer_text(apps::answer_from(written)) == written);
    for (const apps::KeyedOutcome& keyed : answer.outcomes) {
      const bool is_possible = merge::fault_of(keyed.outcome).empty();
      require(!is_possible || keyed.outcome.T_match_query.is_rigid());
    }
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text = fuzz::text_of(data + 1, size - 1);
  data[0] % 2 == 0 ? read_job(text) : read_answer(text);
  return 0;
}
