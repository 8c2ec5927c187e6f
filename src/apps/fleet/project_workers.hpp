// Workers of a fleet for the merge of a stored project.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "ports/nats/job_board.hpp"
#include "ports/store/keyframe_reader.hpp"
#include "src/apps/fleet/loop_workers.hpp"
#include "src/apps/map/stored_result.hpp"

namespace unimapper::apps {

/// Has the loops of a stored project verified by workers. Not thread safe.
class ProjectWorkers {
 public:
  /// `store`: the project's. Throws nats_port::NatsError where the server cannot be reached.
  ProjectWorkers(const nats_port::Server& server, const std::filesystem::path& store,
                 const merge::MergeConfig& config);

  /// As `VerifyElsewhere`.
  std::vector<merge::LoopConstraint> verify(const KeyframeRows& rows,
                                            std::span<const merge::LoopQuestion> questions,
                                            const merge::CorrectionLimit& limit,
                                            const merge::VerifyHere& verify_here);

  /// Who verified how many loops, in words.
  [[nodiscard]] std::string text() const { return workers_.text(); }

 private:
  /// Puts a keyframe on the board, once; returns its name.
  const std::string& publish(const KeyframeRows& rows, KeyframeId k);

  const merge::MergeConfig& config_;
  store::KeyframeReader reader_;
  std::unique_ptr<nats_port::JobBoard> board_;
  LoopWorkers workers_;
  std::map<KeyframeId, std::string> published_;
};

}  // namespace unimapper::apps
