// `unimapper evaluate loops`: precision and recall of a run's loops.
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/evaluate/json.hpp"
#include "src/apps/evaluate/run_keyframes.hpp"
#include "src/merge/export/loops_csv.hpp"

namespace unimapper::apps {
namespace {

/// A run folder holds both kinds of loops; an evaluation is about one of them.
std::vector<LoopRecord> select_loops(std::vector<LoopRecord> loops, bool same_session) {
  std::erase_if(loops, [same_session](const LoopRecord& loop) {
    return (loop.query_session == loop.match_session) != same_session;
  });
  return loops;
}

}  // namespace

std::string evaluate_loops(const EvaluateLoopsOptions& options) {
  const bool same_session = options.against.empty();
  const RunKeyframes queries = read_run_keyframes(options.run, options.truth);
  const RunKeyframes references =
      same_session ? queries : read_run_keyframes(options.against, options.against_truth);
  if (!same_session && references.session == queries.session) {
    throw std::runtime_error("both runs are of session \"" + queries.session +
                             "\"; intra-session loops are evaluated without --against");
  }
  const auto loops = select_loops(merge::read_loops_csv(options.run / "loops.csv"), same_session);
  evaluate::LoopScoreConfig config;
  config.threshold_m = options.threshold_m;
  config.same_session = same_session;
  config.min_gap_keyframes = options.min_gap_keyframes;
  return loops_json(options,
                    evaluate::score_loops(queries.keyframes, references.keyframes, loops, config));
}

}  // namespace unimapper::apps
