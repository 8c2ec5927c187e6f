// Share of `unimapper onboard`: topics in shared memory, and handles of them over LCM.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ports/lcm/doorbell.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "src/apps/onboard/onboard_options.hpp"

namespace unimapper::apps {

/// Announces what is published on one topic. A thread of its own sleeps on the topic's word, as
/// consumers do: the pipeline's thread does no more than without it.
class TopicAnnouncer {
 public:
  /// `topic` outlives it. Throws what `lcm_port::Doorbell` throws.
  TopicAnnouncer(const std::string& url, const std::string& share, const char* name,
                 const shared_memory::Writer& topic);
  /// Announces what was published last, too.
  ~TopicAnnouncer();
  TopicAnnouncer(const TopicAnnouncer&) = delete;
  TopicAnnouncer& operator=(const TopicAnnouncer&) = delete;

 private:
  void run();

  const shared_memory::Writer& topic_;
  lcm_port::Doorbell doorbell_;
  std::uint32_t announced_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

/// Topics in shared memory for as long as it lives.
class Share {
 public:
  /// Throws std::runtime_error with a sentence for the user.
  Share(const OnboardOptions& options, const PipelineConfig& config, const SessionId& session);
  ~Share();
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

  shared_memory::PipelineShare* get() { return &share_; }

 private:
  void announce(const OnboardOptions& options);

  shared_memory::PipelineShare share_;
  std::vector<std::unique_ptr<TopicAnnouncer>> announcers_;
};

/// Null if nothing is to be shared.
std::unique_ptr<Share> open_share(const OnboardOptions& options, const PipelineConfig& config,
                                  const SessionId& session);

}  // namespace unimapper::apps
