#include "src/apps/evaluate/map_loops.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "src/merge/export/loops_csv.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {
namespace {

/// Keyframes of all sessions under one numbering, sessions farther apart than the gap that a search
/// within one session keeps.
struct NumberedKeyframes {
  std::vector<evaluate::TrueKeyframe> keyframes;
  std::unordered_map<std::string, std::uint32_t> first;  ///< number of a session's sequence 0
};

NumberedKeyframes numbered(std::span<const ShownSession> shown,
                           std::span<const PairedSession> paired, std::uint32_t gap) {
  NumberedKeyframes all;
  std::uint32_t next = 0;
  for (const ShownSession& session : shown) {
    const auto with_truth = std::find_if(paired.begin(), paired.end(), [&](const PairedSession& p) {
      return p.name == session.name;
    });
    if (with_truth == paired.end() || session.sequences.empty()) continue;
    all.first[session.name] = next;
    const auto nearest = evaluate::nearest_in_time(session.stamps_ns, with_truth->truth);
    for (std::size_t k = 0; k < nearest.size(); ++k) {
      if (!nearest[k]) continue;
      all.keyframes.push_back(
          {next + session.sequences[k], 0, with_truth->truth[*nearest[k]].T_world_sensor});
    }
    next += session.sequences.back() + 1 + gap;
  }
  return all;
}

}  // namespace

evaluate::LoopScore score_map_loops(const std::filesystem::path& map,
                                    std::span<const ShownSession> shown,
                                    std::span<const PairedSession> paired) {
  evaluate::LoopScoreConfig config;
  config.min_gap_keyframes = PipelineConfig{}.search_scope.min_keyframe_gap;
  const NumberedKeyframes all = numbered(shown, paired, config.min_gap_keyframes);
  std::vector<LoopRecord> loops;
  for (LoopRecord& loop : merge::read_loops_csv(map / "loops.csv")) {
    const auto query = all.first.find(loop.query_session);
    const auto match = all.first.find(loop.match_session);
    if (query == all.first.end() || match == all.first.end()) continue;
    loop.query_keyframe += query->second;
    loop.match_keyframe += match->second;
    // The search below goes back in time; which of two sessions was searched for does not matter.
    if (loop.query_keyframe < loop.match_keyframe) {
      std::swap(loop.query_keyframe, loop.match_keyframe);
      loop.T_match_query = loop.T_match_query.inverse();
    }
    loops.push_back(std::move(loop));
  }
  return evaluate::score_loops(all.keyframes, all.keyframes, loops, config);
}

}  // namespace unimapper::apps
