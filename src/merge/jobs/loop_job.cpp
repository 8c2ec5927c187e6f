#include "loop_job.hpp"

#include <algorithm>
#include <bit>
#include <compare>
#include <cstdint>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>

#include "src/core/voxel_key.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/sessions/keyframe_summaries.hpp"

namespace unimapper::merge {
namespace {

/// Letters of a reason: none of a verification is half as long.
constexpr std::size_t kMostReason = 200;

/// Of the questions that are left of a lane, what the next job has: the last ones are small, so
/// that all workers end together.
constexpr std::size_t kShare = 3;

/// A job's place among those of all lanes: which of its lane it is, then its lane's number with its
/// bits reversed.
struct JobOrder {
  std::size_t number = 0;
  std::uint32_t reversed_lane = 0;
  auto operator<=>(const JobOrder&) const = default;
};

std::uint32_t reversed(std::uint32_t bits) {
  std::uint32_t result = 0;
  for (int i = 0; i < 32; ++i, bits >>= 1U) result = result << 1U | (bits & 1U);
  return result;
}

/// Questions about the same keyframes follow each other, so that whoever takes some needs few
/// clouds: next comes the keyframe with the largest share of its questions about those before it.
/// O(questions log keyframes).
std::vector<std::size_t> by_shared_keyframes(std::span<const LoopQuestion> questions,
                                             std::span<const std::size_t> chosen) {
  struct Keyframe {
    std::vector<std::size_t> questions;
    std::size_t shared = 0;  ///< questions with keyframes that have come
    bool has_come = false;
  };
  std::map<KeyframeId, Keyframe> keyframes;
  for (const std::size_t i : chosen) {
    keyframes[questions[i].query].questions.push_back(i);
    keyframes[questions[i].match].questions.push_back(i);
  }
  using Rank = std::tuple<double, std::size_t, KeyframeId>;  // the first comes next
  const auto rank_of = [&](KeyframeId k) {
    const Keyframe& keyframe = keyframes.at(k);
    const std::size_t all = keyframe.questions.size();
    return Rank(-static_cast<double>(keyframe.shared) / static_cast<double>(all),
                all - keyframe.shared, k);
  };
  std::set<Rank> waiting;
  for (const auto& [k, keyframe] : keyframes) waiting.insert(rank_of(k));
  std::vector<std::size_t> order;
  while (!waiting.empty()) {
    const KeyframeId next = std::get<KeyframeId>(*waiting.begin());
    waiting.erase(waiting.begin());
    keyframes[next].has_come = true;
    for (const std::size_t i : keyframes[next].questions) {
      const LoopQuestion& question = questions[i];
      const KeyframeId other = question.query == next ? question.match : question.query;
      if (keyframes[other].has_come) {
        order.push_back(i);
        continue;
      }
      waiting.erase(rank_of(other));
      ++keyframes[other].shared;
      waiting.insert(rank_of(other));
    }
  }
  return order;
}

/// The keyframe and those that join its cloud.
void add_with_neighbours(const std::vector<SessionData>& sessions, KeyframeId k,
                         std::set<KeyframeId>& needed) {
  needed.insert(k);
  for (const std::size_t i :
       whole_neighbours(sessions[k.session].keyframes, k.keyframe, kSubmapKeyframes)) {
    needed.insert({k.session, i});
  }
}

bool can_be_sent(const std::vector<SessionData>& sessions, const LoopQuestion& question) {
  const auto is_summary = [&](KeyframeId k) {
    return sessions[k.session].keyframes[k.keyframe].is_summary;
  };
  return question.T_match_query.is_rigid() && !is_summary(question.query) &&
         !is_summary(question.match);
}

}  // namespace

std::string question_key(const LoopQuestion& question) {
  const Pose& T = question.T_match_query;
  std::uint64_t state = question.fingerprint;
  for (const double number : T.rotation.reshaped()) {
    state = mix_bits(state ^ std::bit_cast<std::uint64_t>(number)) + 1;
  }
  for (const double number : T.translation) {
    state = mix_bits(state ^ std::bit_cast<std::uint64_t>(number)) + 1;
  }
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx",
                static_cast<unsigned long long>(question.fingerprint),
                static_cast<unsigned long long>(state));
  return text;
}

std::vector<PlacedJob> make_jobs(const std::vector<SessionData>& sessions,
                                 std::span<const LoopQuestion> questions, const LoopJob& common,
                                 const KeyframeNaming& name_of, const JobSizes& sizes) {
  std::vector<std::size_t> sendable;
  for (std::size_t i = 0; i < questions.size(); ++i) {
    if (can_be_sent(sessions, questions[i])) sendable.push_back(i);
  }
  const std::vector<std::size_t> order = by_shared_keyframes(questions, sendable);
  const std::size_t lanes = std::clamp<std::size_t>(order.size() / sizes.least, 1, sizes.lanes);
  std::map<JobOrder, PlacedJob> jobs;
  for (std::uint32_t lane = 0; lane < lanes; ++lane) {
    const std::size_t end = (lane + 1) * order.size() / lanes;
    std::size_t number = 0;
    for (std::size_t begin = lane * order.size() / lanes; begin < end; ++number) {
      const std::size_t left = end - begin;
      const std::size_t size = std::min(left, std::clamp(left / kShare, sizes.least, sizes.most));
      PlacedJob placed{common, lane, {}};
      placed.job.name += std::to_string(jobs.size());
      std::set<KeyframeId> needed;
      for (std::size_t i = begin; i < begin + size; ++i) {
        const LoopQuestion& question = questions[order[i]];
        placed.positions.push_back(order[i]);
        placed.job.questions.push_back(question);
        add_with_neighbours(sessions, question.query, needed);
        add_with_neighbours(sessions, question.match, needed);
      }
      for (const KeyframeId k : needed) {
        const KeyframeRecord& keyframe = sessions[k.session].keyframes[k.keyframe];
        placed.job.keyframes.push_back({k, name_of(k), keyframe.T_odometry_keyframe, keyframe.up});
      }
      jobs.emplace(JobOrder{number, reversed(lane)}, std::move(placed));
      begin += size;
    }
  }
  std::vector<PlacedJob> in_order;
  for (auto& [place, placed] : jobs) in_order.push_back(std::move(placed));
  return in_order;
}

std::string fault_of(const LoopConstraint& outcome) {
  if (!outcome.T_match_query.is_rigid()) return "its pose is no rigid transform";
  if (!outcome.information.allFinite()) return "its information is not finite";
  if (!outcome.information.isApprox(outcome.information.transpose(), 1e-9)) {
    return "its information is not symmetric";
  }
  if (outcome.information.diagonal().minCoeff() < 0.0) return "its information is negative";
  if (!(outcome.overlap >= 0.0 && outcome.overlap <= 1.0)) return "its overlap is no share";
  if (outcome.decision.accepted != outcome.decision.reason.empty()) {
    return "its reason and its decision contradict each other";
  }
  const std::string& reason = outcome.decision.reason;
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (reason.size() > kMostReason || !std::all_of(reason.begin(), reason.end(), is_printable)) {
    return "its reason is no text";
  }
  return {};
}

}  // namespace unimapper::merge
