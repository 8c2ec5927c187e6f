// Board of jobs: a queue of work and its answers.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ports/nats/server.hpp"

namespace unimapper::nats_port {

/// How many workers get a job before it is set aside: it may be what ended them.
inline constexpr std::uint32_t kMostDeliveries = 3;

/// Where who asks puts jobs and reads answers. Functions throw `NatsError`.
class JobBoard {
 public:
  virtual ~JobBoard() = default;

  /// Makes the bytes of a keyframe available to workers under a name.
  virtual void put_keyframe(const std::string& name, std::span<const std::uint8_t> bytes) = 0;
  /// Hands out a job in a lane. Returns its number on the board.
  virtual std::uint64_t put_job(const std::string& text, std::uint32_t lane) = 0;
  /// Takes a job back. False if a worker has it or had it; then also those before it in its lane.
  virtual bool take_back(std::uint64_t number, std::uint32_t lane) = 0;
  /// Numbers of jobs that ended so many workers, as the server counts them: they go to no other
  /// one. Each is said once.
  virtual std::vector<std::uint64_t> set_aside() = 0;
  /// The next answer that was given since the board was opened, or that is kept from before; waits
  /// so long for it.
  virtual std::optional<std::string> next_answer(std::chrono::milliseconds wait) = 0;
};

/// Where workers take jobs and answer. Functions throw `NatsError`.
class JobSource {
 public:
  virtual ~JobSource() = default;

  /// The next job, of the lane of the latest one if there is any; waits so long for it.
  virtual std::optional<std::string> next_job(std::chrono::milliseconds wait) = 0;
  /// Keeps the job that was taken last from going to another worker for a while. From any thread
  /// that works on it.
  virtual void tell_progress() = 0;
  /// Answers the job that was taken last, which is done then.
  virtual void answer(const std::string& text) = 0;
  /// The bytes of a keyframe. Throws where there is none of that name. Thread safe.
  virtual std::vector<std::uint8_t> keyframe(const std::string& name) = 0;
  /// Versions of workers for which jobs wait.
  virtual std::vector<std::string> versions_wanted() = 0;
};

/// Which jobs and answers.
struct BoardNames {
  std::string version;  ///< of the workers that may take jobs: letters, digits, '_' or '-'
  std::string project;  ///< whose jobs they are, likewise
};

/// A board on a server. Jobs of the project that an earlier caller has left are taken off; answers
/// of the last day are kept. Throws NatsError.
std::unique_ptr<JobBoard> open_board(const Server& server, const BoardNames& names);
/// A worker that has told no progress in this time is taken for dead; its job goes to another one.
inline constexpr std::chrono::milliseconds kProgress{20'000};

/// Jobs for workers of a version, of all projects. Throws NatsError.
std::unique_ptr<JobSource> open_source(const Server& server, const std::string& version,
                                       std::chrono::milliseconds progress = kProgress);

}  // namespace unimapper::nats_port
