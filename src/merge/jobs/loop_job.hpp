// Jobs of loop verification for other machines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Reason of a loop that was not verified because its job ended several workers.
inline constexpr const char* kSetAside = "set aside: its verification ended several workers";

/// A keyframe that a job needs: of a question, or beside one.
struct JobKeyframe {
  KeyframeId id;             ///< in the merge
  std::string name;          ///< of its bytes, the same in every merge
  Pose T_odometry_keyframe;  ///< as levelled in the merge, metres
  KeyframeUp up;             ///< as levelled in the merge
};

/// Loops to be verified, with all that their outcomes depend on. The fingerprints of the questions
/// tell a worker whether it has the same keyframes and parameters.
struct LoopJob {
  std::string name;    ///< of the job, which its answer repeats
  std::string merge;   ///< names the merge; `KeyframeId`s are its own
  MergeConfig config;  ///< its parameters
  CorrectionLimit limit;
  std::vector<JobKeyframe> keyframes;
  std::vector<LoopQuestion> questions;
};

/// A job and where its questions were among those that it was made of.
struct PlacedJob {
  LoopJob job;
  std::uint32_t lane = 0;  ///< jobs of a lane, and of lanes beside each other, share keyframes
  std::vector<std::size_t> positions;
};

/// What the outcome of a question is kept under: 128 bits of fingerprint and proposed pose, as
/// text.
std::string question_key(const LoopQuestion& question);

/// The name of a keyframe's bytes.
using KeyframeNaming = std::function<std::string(KeyframeId)>;

/// Questions of a job, as long as there are so many, and how many lanes there are.
struct JobSizes {
  std::size_t least = 8;
  std::size_t most = 64;
  std::size_t lanes = 16;
};

/// Jobs of questions that share keyframes, in lanes; the last ones of each lane are small. The
/// first job of every lane comes before the second of any, those of lanes far apart first.
/// Questions without keyframes of their own (summaries) or with a pose that is not rigid are in
/// none of them.
std::vector<PlacedJob> make_jobs(const std::vector<SessionData>& sessions,
                                 std::span<const LoopQuestion> questions, const LoopJob& common,
                                 const KeyframeNaming& name_of, const JobSizes& sizes = {});

/// Why the outcome of a question cannot be what a verification answers, in words; empty: it can.
std::string fault_of(const LoopConstraint& outcome);

}  // namespace unimapper::merge
